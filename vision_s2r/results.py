"""A table of results: printed, and as the JSON that pages of results are made of.

`columns` and `rows`, whose cells are text, numbers, or {value, low, high} with a 95 % interval; `command` makes it.
"""

import json
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from vision_s2r.files import write

WIDTH = 200


def publish(path: Path, command: str, columns: Sequence[str], rows: Sequence[Sequence[Any]], title: str = "") -> Path:
    """Print a table and write it to a JSON file, numbers to three digits; returns the path."""
    rounded = [[_rounded(cell) for cell in row] for row in rows]
    content = {"command": command, "columns": list(columns), "rows": rounded}
    show(content, title)
    return write(path, json.dumps(content, indent=1, ensure_ascii=False) + "\n")


def command_line(usual: str) -> str:
    """The command that runs, without where it writes and how many jobs it has; `usual` in another program."""
    program, *words = Path(sys.argv[0]), *sys.argv[1:]
    if program.parent.name == "scripts":  # a door to the command of its name
        words = [program.stem.replace("_", "-"), *words]
    elif program.name not in ("vision-s2r", "__main__.py"):
        return usual
    return shlex.join(["vision-s2r", *(word for word in words if not word.startswith(("out=", "jobs=")))])


def show(content: Mapping[str, Any], title: str = "") -> None:
    """Print `columns` and `rows`."""
    table = Table(*content["columns"], title=title or None)
    for row in content["rows"]:
        table.add_row(*map(_text, row))
    Console(width=WIDTH).print(table)


def _rounded(cell: Any) -> Any:
    return float(f"{cell:.3g}") if isinstance(cell, float) else cell


def _text(cell: Any) -> str:
    if isinstance(cell, Mapping):
        return f"{cell['value']} ({cell['low']} to {cell['high']})"
    return cell if isinstance(cell, str) else f"{cell:g}" if isinstance(cell, float) else f"{cell:,}"
