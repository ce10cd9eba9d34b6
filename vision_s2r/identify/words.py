"""An identification in words: a table of the parameters, and a few sentences."""

import io
from typing import Any

import rich.box
from rich.console import Console
from rich.table import Table

from vision_s2r.identify.estimate import title
from vision_s2r.report import words

WIDTH = 120  # characters


def words_of(result: dict[str, Any]) -> str:
    """A result as a table and a few sentences."""
    table = Table(box=rich.box.SIMPLE, show_edge=False, pad_edge=False)
    for name in ("parameter", "simulator", "identified", "95 % interval", "unit"):
        table.add_column(name, justify="left" if name in ("parameter", "unit") else "right")
    for effect in result["effects"]:
        for key, each in effect["parameters"].items():
            was = words.rounded(each["nominal"], each["ci"]) if "nominal" in each else "–"
            interval = "held" if each.get("held") else words.interval(each)
            name = title((effect["name"], key)).replace("_", " ").replace(".", ", ")
            table.add_row(name, was, words.rounded(each["value"], each["ci"]), interval, each["unit"])
    text = io.StringIO()
    console = Console(file=text, width=WIDTH)
    console.print(table)
    return "\n".join([text.getvalue(), *_sentences(result)])


def _sentences(result: dict[str, Any]) -> list[str]:
    gap = result["gap"]
    before, after, floor = (f"{words.number(gap[key])} {gap['unit']}" for key in ("before", "after", "floor"))
    lines = [f"{gap['metric'].replace('_', ' ')}, held out: {before} before, {after} after; noise {floor}"]
    if result["intervals_of"] != "this recording":
        lines.append("more than noise is left: intervals are as wide as another motion would find the values")
    units = {
        "position_rmse": gap["unit"].removesuffix("/s"),
        "velocity_rmse": gap["unit"],
        "torque_error": "of the torque",
    }
    for where, errors in (("", result), (" on the other recording", result.get("validation", {}))):
        for key in (key for key in units if key in errors):
            one, other = (f"{words.number(errors[key][end])} {units[key]}" for end in ("before", "after"))
            lines.append(f"{key.replace('_', ' ')}{where}: {one} before, {other} after")
    for key, verb in (("unidentified", "not identified"), ("doubtful", "doubtful")):
        lines += [f"{verb}: {each['name'].replace('_', ' ')}, {each['why']}" for each in result[key]]
    return [*lines, result["next_experiment"]] if result["next_experiment"] else lines
