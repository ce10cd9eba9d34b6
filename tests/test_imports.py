"""Imports run one way, what is below knows nothing of what is above; and a name is one thing."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[1] / "vision_s2r"

# From the bottom up; those of one row do not know each other either.
ROWS = (("recording",), ("fit",), ("report",), ("patch",), ("identify", "diagnose"), ("close_gap",))


def test_nothing_below_imports_what_is_above() -> None:
    graph = rooms()
    row = {room: k for k, rooms_of_row in enumerate(ROWS) for room in rooms_of_row}
    upward = [
        f"{room} imports {other}"
        for room in row
        for other in sorted(graph[room])
        if other in row and row[other] >= row[room]
    ]
    assert upward == []
    # And not by a detour either, nor anywhere else in the package.
    in_no_circle(graph)


def test_no_file_imports_in_a_circle() -> None:
    files = {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in ROOT.rglob("*.py")}
    # A package's own file hands on what others define.
    in_no_circle({name: {*_files(path, files)} - {name} for name, path in files.items() if path.stem != "__init__"})


def in_no_circle(graph: dict[str, set[str]]) -> None:
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError("these import each other: " + " ← ".join(error.args[1])) from None


def test_a_class_is_the_only_one_of_its_name() -> None:
    named: dict[str, list[str]] = {}
    for path in sorted(ROOT.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                named.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    assert {name: paths for name, paths in named.items() if len(paths) > 1} == {}


def rooms() -> dict[str, set[str]]:
    """The rooms, and modules, of the package, and those that each imports."""
    graph: dict[str, set[str]] = {}
    for path in ROOT.rglob("*.py"):
        room = path.relative_to(ROOT).parts[0].removesuffix(".py")
        if room == "__init__":
            continue
        graph.setdefault(room, set()).update(other for other in _imported(path) if other != room)
    return graph


def _files(path: Path, files: dict[str, Path]) -> Iterator[str]:
    """The files that a file imports, or whose names it does."""
    for parts in _names(path):
        yield from (".".join(parts[:k]) for k in (len(parts), len(parts) - 1) if ".".join(parts[:k]) in files)


def _imported(path: Path) -> Iterator[str]:
    """The rooms that a file imports."""
    return (parts[0] for parts in _names(path))


def _names(path: Path) -> Iterator[list[str]]:
    """What a file imports of the package, wherever in it; also by name, where that waits until it is needed."""
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{each.name}" for each in node.names]
        elif isinstance(node, ast.Import):
            names = [each.name for each in node.names]
        elif isinstance(node, ast.Call) and getattr(node.func, "id", "") == "load":
            names = [each.value for each in ast.walk(node) if isinstance(each, ast.Constant)]
        for name in names:
            parts = str(name).replace(":", ".").split(".")
            if parts[0] == "vision_s2r" and len(parts) > 1:
                yield parts[1:]
