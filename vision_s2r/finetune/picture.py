"""Success against real grasps, as a picture."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from vision_s2r.files import write_figure
from vision_s2r.finetune.config import SCRATCH

LEAST = 20  # where the axis of grasps, logarithmic from there on, has its 0


def draw(points: list[dict[str, Any]], path: Path) -> Path:
    """A line a start, 95 % intervals. Returns the PNG's path."""
    figure = Figure(figsize=(7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    for k, start in enumerate(dict.fromkeys(point["start"] for point in points)):
        some = [point for point in points if point["start"] == start]
        shift = 1 + 0.03 * k  # whiskers side by side
        at = [max(point["grasps"], LEAST) * shift for point in some]
        values = [100 * point["value"] for point in some]
        below = [100 * (point["value"] - point["low"]) for point in some]
        above = [100 * (point["high"] - point["value"]) for point in some]
        style = "--" if start == SCRATCH else "-"
        axes.errorbar(
            at, values, yerr=(below, above), label=start.replace("_", " "), ls=style, marker="o", ms=4, lw=1.3
        )
    axes.set_xscale("log")
    counts = sorted({point["grasps"] for point in points})
    axes.set_xticks([max(count, LEAST) for count in counts], [str(count) for count in counts])
    axes.minorticks_off()
    axes.set_xlabel("labelled real grasps")
    axes.set_ylabel("grasps held, %")
    axes.set_ylim(0, 100)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, frameon=False, ncols=2)
    return write_figure(path, figure, dpi=130)
