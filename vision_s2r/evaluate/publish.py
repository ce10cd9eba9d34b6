"""What a page of results needs of an evaluation: `python -m vision_s2r.evaluate.publish TABLE.json OUT/NAME COMMAND`.

OUT/NAME.json is the table.json without its checkpoints' configurations; OUT/NAME_compared.json a plain table of
its differences (points) and ratios (%), as docs/hooks/tables.py reads both.
"""

import json
import sys
from pathlib import Path
from typing import Any

from vision_s2r.cli import or_exit
from vision_s2r.errors import UserError
from vision_s2r.evaluate.table import FORMAT
from vision_s2r.files import write

KEPT = ("format", "seed", "columns", "cells", "differences", "ratios", "versions")


def publish(table: Path, out: Path, command: str) -> list[Path]:
    """Writes both; `command` is what made the table. Raises UserError where it is no transfer table."""
    try:
        data = json.loads(table.read_text())
    except (OSError, ValueError) as error:
        raise UserError(f"{table}: {error}") from error
    if data.get("format") != FORMAT:
        raise UserError(f"{table} is no transfer table: expected format '{FORMAT}'")
    compact = {key: data[key] for key in KEPT} | {"command": command}
    compact["columns"] = [{"name": column["name"]} for column in data["columns"]]
    compact["scenes"] = {"count": data["scenes"]["count"], "seed": data["scenes"]["render"]["seed"]}
    compact["training"] = {
        row: [{role: known["training"] for role, known in seed.items()} for seed in seeds]
        for row, seeds in data["checkpoints"].items()
    }
    contents = {"": compact, "_compared": compared(data) | {"command": command}}
    return [
        write(out.with_name(f"{out.name}{suffix}.json"), json.dumps(content, indent=1) + "\n")
        for suffix, content in contents.items()
    ]


def compared(data: dict[str, Any]) -> dict[str, Any]:
    """A line for each pair of rows, differences then ratios, of a table.json: `columns` and `rows`."""
    columns = [column["name"] for column in data["columns"]]
    rows = []
    for key, sign, unit in (("differences", "−", "points"), ("ratios", "/", "%")):
        for first, second in dict.fromkeys((each["first"], each["second"]) for each in data[key]):
            found = {each["column"]: each for each in data[key] if (each["first"], each["second"]) == (first, second)}
            named = f"{first.replace('_', ' ')} {sign} {second.replace('_', ' ')}, {unit}"
            rows.append([named, *(percent(found[column]) for column in columns)])
    return {"columns": ["", *columns], "rows": rows}


def percent(estimate: dict[str, Any]) -> Any:
    """A share with its interval as a cell of a results page, in percent."""
    if any(estimate[part] is None for part in ("value", "low", "high")):  # over none
        return "–"
    return {part: round(100 * estimate[part], 1) for part in ("value", "low", "high")}


def _run() -> None:
    if len(sys.argv) != 4:
        raise UserError(f"expected TABLE.json, OUT/NAME and COMMAND, not {len(sys.argv) - 1} arguments")
    print(*publish(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]), sep="\n")


if __name__ == "__main__":
    or_exit(_run)
