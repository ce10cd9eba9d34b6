"""What closing the loop won, as a picture."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vision_s2r.close_gap.summary import LABELS
from vision_s2r.files import write_figure
from vision_s2r.statistics import wilson

COLOURS = ("#9aa5b1", "#d9a441", "#2f7ed8", "#7fb2ea", "#2b9348")
ABREAST = 5  # robots side by side


def draw(robots: list[dict[str, Any]], path: Path) -> Path:
    """A group of bars a robot: grasp success of each row, 95 % intervals. Returns the PNG's path."""
    lines = [robots[k : k + ABREAST] for k in range(0, len(robots), ABREAST)]
    width = max(2.2 + 1.7 * len(lines[0]), 7.0)
    figure = Figure(figsize=(width, 0.4 + 3.2 * len(lines)), layout="constrained")
    every = figure.subplots(len(lines), 1, squeeze=False)[:, 0]
    for axes, some in zip(every, lines, strict=True):
        _bars(axes, some)
        axes.set_xlim(-0.6, len(lines[0]) - 0.4)
    every[0].legend(fontsize=7, ncols=len(LABELS), loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return write_figure(path, figure, dpi=130)


def _bars(axes: Axes, robots: list[dict[str, Any]]) -> None:
    rows = [row for row in LABELS if row in robots[0]["success"]]
    width = 0.85 / len(rows)
    for k, row in enumerate(rows):
        found = [wilson(round(r["success"][row] * r["attempts"]), r["attempts"]) for r in robots]
        values = np.array([(e.value, e.value - e.low, e.high - e.value) for e in found]).T * 100
        at = np.arange(len(robots)) + (k - (len(rows) - 1) / 2) * width
        axes.bar(at, values[0], width, yerr=values[1:], color=COLOURS[k], label=LABELS[row], error_kw={"lw": 1})
    axes.set_xticks(np.arange(len(robots)), [_name(robot) for robot in robots], fontsize=7)
    axes.set_ylabel("grasps held, %")
    axes.set_ylim(0, 100)


def _name(robot: dict[str, Any]) -> str:
    """The robot, and an effect a line: the true ones, where they are known."""
    truth = robot["truth"] or {}
    effects = [f"{part}: {name}" for part, each in truth.items() for name in each]
    effects = effects or [f"{each['part']}: {each['name']}" for each in robot["named"]]
    return "\n".join([robot["robot"], *(effect.replace("_", " ") for effect in effects)])
