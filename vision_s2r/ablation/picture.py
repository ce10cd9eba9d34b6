"""The ablation in pictures: each variant's change of success and metrics; what each makes of the same scenes."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from vision_s2r.ablation.summary import METRICS, SUCCESS, AblationSummary, shown
from vision_s2r.evaluate import drawing
from vision_s2r.files import write, write_figure

INK, RULE = "#1f2328", "#9aa5b1"
COLOURS = ("#2f7ed8", "#d9702e", "#2b9348")  # by family, in order
MAP = "RdBu"  # worse than the reference red, better blue
STRONGEST = 0.5  # change, as a share of the reference's value, from which on the colour is the strongest
DPI = 130


def draw(summary: AblationSummary, path: Path) -> Path:
    """Left: change of success in points with 95 % intervals. Right: every metric, coloured by its change.

    Returns the PNG's path.
    """
    count = len(summary.variants)
    figure = Figure(figsize=(12, 1.6 + 0.42 * count), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1, 1.5))
    _changes(left, summary)
    _metrics(right, summary)
    left.set_yticks(range(count), [variant.replace("_", " ") for variant in summary.variants])
    left.set_ylim(count - 0.5, -0.5)
    return write_figure(path, figure, DPI)


def side_by_side(sheets: Mapping[str, Path], path: Path) -> Path:
    """The same scenes as they are and as each variant translates them: the rows of their own sheets, as one PNG."""
    strips: dict[str, np.ndarray] = {}
    for variant, sheet in sheets.items():
        above, below = np.split(np.asarray(Image.open(sheet)), 2)
        strips.setdefault("picture", above)
        strips[variant] = below
    inner = (slice(drawing.FRAME, -drawing.FRAME), slice(drawing.LABEL, -drawing.FRAME))
    return write(path, drawing.png(drawing.sheet({label: strip[inner] for label, strip in strips.items()})))


def _changes(axes: Axes, summary: AblationSummary) -> None:
    families = list(dict.fromkeys(map(summary.family, summary.variants)))
    axes.axvline(0, color=RULE, lw=1)
    for at, variant in enumerate(summary.variants):
        colour = COLOURS[families.index(summary.family(variant)) % len(COLOURS)]
        row = summary.rows[variant, SUCCESS]
        if row.change is None:
            axes.plot(0, at, "D", color=colour, ms=6)
            axes.annotate(f"{100 * row.value.value:.1f} %", (0, at), (7, 0), textcoords="offset points", va="center")
            continue
        low, value, high = (100 * end for end in (row.change.low, row.change.value, row.change.high))
        axes.plot([low, high], [at, at], color=colour, lw=1.5)
        axes.plot(value, at, "o", color=colour, ms=6)
    axes.set_xlabel(f"change of grasp success, points ({', '.join(summary.cameras)}; {summary.scenes} scenes)")
    axes.grid(axis="x", alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)


def _metrics(axes: Axes, summary: AblationSummary) -> None:
    better = np.full((len(summary.variants), len(METRICS)), np.nan)  # relative, positive where better
    for at, variant in enumerate(summary.variants):
        for column, (metric, less) in enumerate(METRICS.items()):
            row = summary.rows.get((variant, metric))
            if row is None:
                continue
            reach = row.value.high - row.value.value
            text = shown(row.value.value) + (f"\n±{reach:.1g}" if math.isfinite(reach) else "")
            axes.text(column, at, text, ha="center", va="center", fontsize=7.5, color=INK)
            if row.change is not None:
                base = abs(row.value.value - row.change.value) or 1.0
                better[at, column] = (-1 if less else 1) * row.change.value / base
    axes.imshow(better, cmap=MAP, vmin=-STRONGEST, vmax=STRONGEST, aspect="auto", alpha=0.6)
    labels = [f"{name} {'↓' if less else '↑'}".replace("_", "\n") for name, less in METRICS.items()]
    axes.set_xticks(range(len(METRICS)), labels, fontsize=7.5)
    axes.tick_params(length=0, top=True, labeltop=True, bottom=False, labelbottom=False, labelleft=False)
    axes.set_xlabel("validation, mean over seeds ± 95 %; blue better, red worse than the reference", fontsize=8)
    axes.spines[:].set_visible(False)
