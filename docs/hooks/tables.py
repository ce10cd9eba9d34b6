"""Tables of results, from the JSON that runs write.

A page asks for one by a line of its own, `<!-- table: NAME -->`, or `<!-- table: NAME rows=0,1 columns=0,2 -->` for a
part of it, and gets docs/results/data/NAME.json; `NAME+OTHER` sets the first figures of several beside each other, a
row a title, under the last words of their names. Two forms are known: the transfer table of an evaluation
(`table.json`), and a plain table, `columns` and `rows`, whose cells are text, numbers, or
`{value, low, high, unit, of}` with a 95 % interval. `command` says what makes it, `source` what to know of that run.
In README.md, which nothing builds, the table stands below that line, up to `<!-- end -->`:

    python docs/hooks/tables.py README.md    # write it there anew
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

DATA = Path(__file__).resolve().parents[1] / "results" / "data"
TRANSFER = "vision-s2r/transfer-table/1"
ASKED = re.compile(r"^<!-- table: ([\w+]+)(?: rows=([\d,]+))?(?: columns=([\d,]+))? -->$", re.MULTILINE)
FILLED = re.compile(f"({ASKED.pattern}).*?(?=^<!-- end -->$)", re.MULTILINE | re.DOTALL)
TITLES = {
    "rcan": "RCAN",
    "rcan_student": "RCAN student",
    "rcan_student_before": "the student before",
    "rcan_student_mirrored": "RCAN student, two looks",
    "real": "real look, perfect camera",
}


def table(name: str, rows: str | None = None, columns: str | None = None) -> str:
    """The table in Markdown, or these rows and columns of it. Raises FileNotFoundError where there is none."""
    head, body = _beside(name.split("+")) if "+" in name else _plain(name)
    lines = [head, ["---"] * len(head), *([_cell(each) for each in row] for row in _chosen(body, rows))]
    return "\n".join("| " + " | ".join(_chosen(line, columns)) + " |" for line in lines)


def provenance(name: str) -> str:
    """What makes the table, and what to know of its numbers: a line of Markdown."""
    parts = []
    for data in map(_data, name.split("+")):
        parts += [f"`{data['command']}`", data.get("source", "")]
    return "<small>" + " · ".join(part for part in parts if part) + "</small>"


def with_tables(page: str) -> str:
    """A page with its tables in the place of what asks for them."""
    return ASKED.sub(
        lambda found: f'<div class="results" markdown>\n\n{table(*found.groups())}\n\n{provenance(found[1])}\n\n</div>',
        page,
    )


def refilled(page: str) -> str:
    """A page that holds its tables, with each written anew."""
    return FILLED.sub(lambda found: f"{found[1]}\n\n{table(*found.groups()[1:])}\n\n", page)


def _data(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))
    return found


def _plain(name: str) -> tuple[list[str], list[list[Any]]]:
    data = _data(name)
    return _transfer(data) if data.get("format") == TRANSFER else (data["columns"], data["rows"])


def _beside(names: list[str]) -> tuple[list[str], list[list[Any]]]:
    """The first figure of each table, a row a title; empty where a table has no such row."""
    figures = [{row[0]: row[1] for row in _data(name)["rows"]} for name in names]
    titles = list(dict.fromkeys(title for each in figures for title in each))
    rows = [[title, *(each.get(title, "") for each in figures)] for title in titles]
    return ["", *(name.rpartition("_")[2] for name in names)], rows


def _chosen(items: list[Any], indices: str | None) -> list[Any]:
    return items if indices is None else [items[int(k)] for k in indices.split(",")]


def _cell(cell: Any) -> str:
    if not isinstance(cell, dict):
        return _number(cell)
    unit = f" {cell['unit']}" if "unit" in cell else ""
    count = f"; {cell['of']}" if "of" in cell else ""
    value, interval = _number(cell["value"]), _interval(cell["low"], cell["high"])
    return f"{value}{unit} ({interval}{unit}{count})"


def _number(number: Any, form: str = "") -> str:
    return number if isinstance(number, str) else format(number, form).replace("-", "−")


def _interval(low: float, high: float, form: str = "") -> str:
    return f"{_number(low, form)}{' to ' if low < 0 else '–'}{_number(high, form)}"


def _transfer(data: dict[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Success over all seeds, in percent: a line for each column of the evaluation, then the first difference."""
    cells = {(each["row"], each["column"]): each for each in data["cells"] if each["seed"] == "all"}
    names = list(dict.fromkeys(row for row, _ in cells))
    pairs = list(dict.fromkeys((each["first"], each["second"]) for each in data["differences"]))[:1]
    differences = {each["column"]: each for each in data["differences"] if (each["first"], each["second"]) in pairs}
    columns = ["pictures", *map(_title, names), *(f"{_title(first)} − {_title(second)}" for first, second in pairs)]
    rows = []
    for column in (each["name"] for each in data["columns"]):
        row = [_title(column), *(_percent(cells[name, column], "rate") for name in names)]
        if column in differences:
            one = differences[column]
            text = _percent(one, "value")
            row.append(f"**{text}**" if one["low"] > 0 or one["high"] < 0 else text)
        rows.append(row)
    return columns, rows


def _title(name: str) -> str:
    return TITLES.get(name, name.replace("_", " "))


def _percent(estimate: dict[str, Any], key: str) -> str:
    interval = _interval(100 * estimate["low"], 100 * estimate["high"], ".0f")
    return f"{_number(100 * estimate[key], '.1f')} ({interval})"


if __name__ == "__main__":
    for path in map(Path, sys.argv[1:]):
        path.write_text(refilled(path.read_text(encoding="utf-8")), encoding="utf-8")
