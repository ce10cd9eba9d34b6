"""Spoilt inputs: each reader is to give a result, or one line that says what is wrong. Anything else is a failure."""

import json
import os
import pickle
import shutil
import signal
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from copy import deepcopy
from io import StringIO
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import yaml

from vision_s2r.errors import UserError
from vision_s2r.files import write
from vision_s2r.progress import tracked
from vision_s2r.reliability.samples import READERS, Reader

OUTCOMES = {
    "result": "a result",
    "line": "one line",
    "lines": "several lines",
    "traceback": "a traceback",
    "hang": "hangs",
    "code": "ran code",
}
HANGS = 60  # s, after which a reader counts as hanging
NOTED = 1000  # inputs, after which what is known is noted
TOKENS = (
    *(b"", b"nan", b"inf", b"-1e400", b"1e308", b"-1", b"0", b"0x1", b"1_0", b'"', b"'", b",", b";", b"\n", b"\r"),
    b"\0",
    *(b"\xff\xfe", b"\xef\xbb\xbf", "é".encode(), b"[" * 3000, b"{" * 3000, b"&a [*a]", b"${a}", b"${oc.env:HOME}"),
    *(b"!!python/object:os.system x", b"9" * 400, b"2001-99-99", b"../../..", b"/", b"~", b"null", b"true", b"%s%n"),
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 10**30, -(10**400), 1e308, float("nan"), float("inf"), 0.5, "", "x", "nan", "é\0"),
    *("../..", "/", [], {}, [[]], [1, 2], ["a"], {"a": 1}, [None], "a" * 5000),
)  # fmt: skip


class Touch:
    """Makes a file where it is unpickled: whoever reads it ran code that came from outside."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return Path.touch, (self._path,)


def fuzz(name: str, count: int, seed: int, kept: Path) -> dict[str, Any]:
    """Read so many spoilt inputs of one reader; what came of them, and an example of each kind of failure.

    What is known so far is noted in the file `kept`, from where the same call goes on.
    """
    reader = READERS[name]
    count //= reader.slow
    nothing: dict[str, Any] = {"reader": name, "inputs": 0, "outcomes": {}, "failures": {}}
    found = json.loads(kept.read_text()) if kept.exists() else nothing
    with tempfile.TemporaryDirectory() as folder:
        whole, spoilt, mark = (Path(folder) / each for each in ("whole", "spoilt", "ran"))
        whole.mkdir()
        reader.make(whole)
        if _outcome(reader, whole)[0] != "result":
            raise AssertionError(f"{name}: the input is refused before it is spoilt: {_outcome(reader, whole)}")
        shutil.copytree(whole, spoilt)
        starts = range(found["inputs"], count, NOTED)
        for start in tracked(starts, len(starts), name):
            for k in range(start, min(start + NOTED, count)):
                outcome, why, how = _spoilt_outcome(reader, whole, spoilt, np.random.default_rng([seed, k]), mark)
                found["outcomes"][outcome] = found["outcomes"].get(outcome, 0) + 1
                if outcome not in ("result", "line"):
                    found["failures"].setdefault(why, f"input {k}: {how}")
            found["inputs"] = min(start + NOTED, count)
            write(kept, json.dumps(found))
    return found


def _spoilt_outcome(
    reader: Reader, whole: Path, spoilt: Path, rng: np.random.Generator, mark: Path
) -> tuple[str, str, str]:
    """Spoil one file of a copy, read it, and put it right again: the outcome, where, and how it was spoilt."""
    path, how = _spoil(spoilt, rng, mark)
    outcome, why = _outcome(reader, spoilt)
    if mark.exists():
        outcome, why = "code", "code that came with the input was run"
        mark.unlink()
    if path.is_dir():
        path.rmdir()
    shutil.copyfile(whole / path.relative_to(spoilt), path)
    return outcome, why, how


@contextmanager
def _quiet() -> Iterator[None]:
    """Without what libraries in C say of pictures and videos that are spoilt."""
    before = os.dup(2)
    with Path(os.devnull).open("w") as nothing:
        os.dup2(nothing.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(before, 2)
        os.close(before)


def _outcome(reader: Reader, folder: Path) -> tuple[str, str]:
    """What reading came to: result, line, or what it should not; and where."""
    before = signal.signal(signal.SIGALRM, _hang)
    signal.alarm(HANGS)
    try:
        with warnings.catch_warnings(), _quiet(), redirect_stderr(StringIO()), redirect_stdout(StringIO()):
            warnings.simplefilter("ignore")
            reader.read(folder)
        return "result", ""
    except UserError as error:
        text = str(error)
        return ("line", "") if text and "\n" not in text else ("lines", f"several lines, or none: {text[:200]!r}")
    except TimeoutError:
        return "hang", f"reads for more than {HANGS} s"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)
        ours = next((each for each in reversed(place) if "vision_s2r" in each.filename), place[-1])
        return "traceback", f"{type(error).__name__} in {Path(ours.filename).name}:{ours.lineno}"
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _hang(number: int, frame: FrameType | None) -> None:
    raise TimeoutError


def _spoil(folder: Path, rng: np.random.Generator, mark: Path) -> tuple[Path, str]:
    """Spoil one file of an input; returns which, and how."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    path = paths[rng.integers(len(paths))]
    ways = [_flipped, _flipped, _cut, _doubled, _token, _token, _token, _random]
    ways += [_structured] * 6 if path.suffix in (".json", ".yaml") else []
    ways += [_cell] * 6 if path.suffix in (".csv", ".txt") else []
    ways += [_header] * 6 if path.suffix == ".safetensors" else []
    kind = int(rng.integers(len(ways) + 3))
    if kind < len(ways):
        path.write_bytes(ways[kind](path.read_bytes(), rng))
        return path, f"{ways[kind].__name__} {path.name}"
    if kind == len(ways):
        path.write_bytes(pickle.dumps({"step": Touch(mark)}))
        return path, f"pickle {path.name}"
    path.unlink()
    if kind == len(ways) + 1:
        path.mkdir()
    return path, f"{'folder for' if path.exists() else 'without'} {path.name}"


def _flipped(content: bytes, rng: np.random.Generator) -> bytes:
    data = bytearray(content or b"\0")
    for at in rng.integers(len(data), size=rng.integers(1, 9)):
        data[at] = rng.integers(256)
    return bytes(data)


def _cut(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = sorted(rng.integers(len(content) + 1, size=2))
    return content[:start] if rng.random() < 0.5 else content[:start] + content[end:]


def _doubled(content: bytes, rng: np.random.Generator) -> bytes:
    start, end = sorted(rng.integers(len(content) + 1, size=2))
    return content[:end] + content[start:end] + content[end:]


def _token(content: bytes, rng: np.random.Generator) -> bytes:
    start = int(rng.integers(len(content) + 1))
    return content[:start] + TOKENS[rng.integers(len(TOKENS))] + content[start + int(rng.integers(12)) :]


def _random(content: bytes, rng: np.random.Generator) -> bytes:
    return rng.bytes(int(rng.integers(300)))


def _cell(content: bytes, rng: np.random.Generator) -> bytes:
    rows = [row.split(b",") for row in content.split(b"\n")]
    for _ in range(rng.integers(1, 4)):
        row = rows[0 if rng.random() < 0.2 else rng.integers(len(rows))]
        row[rng.integers(len(row))] = TOKENS[rng.integers(len(TOKENS))]
    return b"\n".join(map(b",".join, rows))


def _structured(content: bytes, rng: np.random.Generator) -> bytes:
    tree = yaml.load(content, yaml.CSafeLoader)
    for _ in range(rng.integers(1, 3)):
        _change(tree, rng)
    with suppress(ValueError, RecursionError):
        return json.dumps(tree).encode()
    return content


def _header(content: bytes, rng: np.random.Generator) -> bytes:
    """The JSON before the tensors, or one that it holds as text."""
    size = int.from_bytes(content[:8], "little")
    head = json.loads(content[8 : 8 + size])
    texts = head.get("__metadata__", {})
    name = str(rng.choice(sorted(texts))) if texts and rng.random() < 0.7 else ""
    if name and texts[name].startswith("{"):
        texts[name] = _structured(texts[name].encode(), rng).decode()
    else:
        _change(head, rng)
    changed = json.dumps(head).encode()
    return len(changed).to_bytes(8, "little") + changed + content[8 + size :]


def _change(tree: Any, rng: np.random.Generator) -> None:
    """One key or element, however deep, gets another value, another name, or goes."""
    places = list(_places(tree))
    if not places:
        return
    holder, key = places[rng.integers(len(places))]
    way = rng.random()
    if way < 0.7:
        holder[key] = deepcopy(VALUES[rng.integers(len(VALUES))])
    elif way < 0.85 or isinstance(holder, list):
        del holder[key]
    else:
        holder[f"{key}x"] = holder.pop(key)


def _places(tree: Any) -> Any:
    keys = tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    for key in list(keys):
        yield tree, key
        yield from _places(tree[key])
