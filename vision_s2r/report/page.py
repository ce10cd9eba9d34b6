"""The page."""

import base64
import html as text
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from matplotlib.figure import Figure

from vision_s2r.files import write
from vision_s2r.report import words
from vision_s2r.report.drawing import png

TEMPLATE = "report.html"


def write_html(report: Mapping[str, Any], figures: Mapping[str, Figure], path: Path) -> None:
    """Write a report's page as `html` makes it. Raises UserError where the file cannot be written."""
    write(path, html(report, figures))


def framed(page: str) -> str:
    """A page within another one, whose styles stay apart: for notebooks."""
    return f'<iframe srcdoc="{text.escape(page)}" style="width: 100%; height: 40rem; border: 0"></iframe>'


def html(report: Mapping[str, Any], figures: Mapping[str, Figure]) -> str:
    """A report as one page that needs no other file and no network; `figures` by caption, shown in their order."""
    return (
        environment()
        .get_template(TEMPLATE)
        .render(
            report=report, gap=report["gap"], figures=figures, sentence=words.verdict(report), bars=_bars(report["gap"])
        )
    )


@cache
def environment() -> jinja2.Environment:
    """Templates of pages, with the filters that put numbers into words."""
    found = jinja2.Environment(
        loader=jinja2.PackageLoader("vision_s2r.report"),
        autoescape=True,  # keys beyond the contract's may be absent, so undefined ones are not an error
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {
        "words": lambda name: name.replace("_", " "),
        "number": words.number,
        "percent": words.percent,
        "ends": words.interval_percent,
        "measured": words.measured,
        "interval": words.interval,
        "room": words.room,
        "png": lambda figure: "data:image/png;base64," + base64.b64encode(png(figure)).decode(),
    }
    return found


def _bars(gap: Mapping[str, Any]) -> list[tuple[str, str, float]]:
    """Label, what it is, and value of each bar of the gap."""
    bars = [("before", "the simulator as it came", gap["before"])]
    if "refitted" in gap and gap["refitted"] != gap["before"]:
        bars.append(("refitted", "the same effects, its parameters fitted", gap["refitted"]))
    bars.append(("after", "with the effects that were found", gap["after"]))
    return [*bars, ("floor", "measurement noise", gap["floor"])]
