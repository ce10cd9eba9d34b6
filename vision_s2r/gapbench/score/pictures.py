"""The confusion matrix and the estimates against the truth, as pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vision_s2r.files import write_figure
from vision_s2r.gapbench.score.score import UNKNOWN_VERDICTS, ParameterScore, Score

SEVERAL, UNKNOWN, NONE = "several", "unknown", "none"


def confusion(scores: Sequence[Score]) -> Figure | None:
    """Machines of one effect, of an unknown one and of none: what is true of them by what was named."""
    pairs = [(_truth(score), _said(score)) for score in scores if _truth(score) and not score.failed]
    if not pairs:
        return None
    ends = [SEVERAL, UNKNOWN, NONE]
    known = sorted({name for pair in pairs for name in pair if name not in ends})
    rows = [name for name in [*known, UNKNOWN, NONE] if any(true == name for true, _ in pairs)]
    columns = [*known, *ends]
    counts = np.zeros((len(rows), len(columns)), dtype=int)
    for true, said in pairs:
        counts[rows.index(true), columns.index(said)] += 1
    shares = counts / counts.sum(axis=1, keepdims=True)
    figure = Figure(figsize=(0.45 * len(columns) + 3, 0.4 * len(rows) + 2.5), layout="constrained")
    axes = figure.subplots()
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1)
    for row, column in np.argwhere(counts):
        colour = "white" if shares[row, column] > 0.6 else "black"
        axes.text(column, row, str(counts[row, column]), ha="center", va="center", color=colour, fontsize=8)
    axes.set_xticks(range(len(columns)), columns, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.set_xlabel("named")
    axes.set_ylabel("true")
    return figure


def _truth(score: Score) -> str:
    """The row of a machine; empty: it has none."""
    if score.case in ("single", "dynamics", "unpaired") and len(score.expected) == 1:
        return score.expected[0]
    return {"unknown": UNKNOWN, "null": NONE}.get(score.case, "")


def _said(score: Score) -> str:
    if len(score.named) == 1:
        return score.named[0]
    if score.named:
        return SEVERAL
    return UNKNOWN if score.verdict in UNKNOWN_VERDICTS else NONE


def estimates(scores: Sequence[Score]) -> Figure | None:
    """A panel for each parameter: estimates with their intervals against the truth."""
    panels: dict[tuple[str, str], list[ParameterScore]] = {}
    for each in (parameter for score in scores for parameter in score.parameters):
        panels.setdefault((each.effect, each.parameter), []).append(each)
    if not panels:
        return None
    across = min(6, len(panels))
    down = -(-len(panels) // across)
    figure = Figure(figsize=(2.3 * across, 2.3 * down), layout="constrained")
    grid = figure.subplots(down, across, squeeze=False)
    for axes in grid.flat[len(panels) :]:
        axes.axis("off")
    for axes, ((effect, parameter), found) in zip(grid.flat, sorted(panels.items()), strict=False):
        _panel(axes, found)
        axes.set_title(f"{effect}\n{parameter}", fontsize=7)
    figure.supxlabel("true")
    figure.supylabel("estimated")
    return figure


def _panel(axes: Axes, found: Sequence[ParameterScore]) -> None:
    true = np.array([each.true for each in found])
    estimate = np.array([each.estimate for each in found])
    low, high = np.array([each.interval for each in found]).T
    spread = np.clip([estimate - low, high - estimate], 0, None)
    ends = [min(true.min(), estimate.min()), max(true.max(), estimate.max())]
    axes.plot(ends, ends, color="0.7", linewidth=1)
    axes.errorbar(true, estimate, spread, fmt=".", markersize=4, elinewidth=0.8, color="tab:blue")
    if ends[0] > 0 and ends[1] > 10 * ends[0]:
        axes.loglog()
    axes.set_ylim(*_around(ends))
    axes.tick_params(labelsize=6)


def _around(ends: Sequence[float]) -> tuple[float, float]:
    """Limits that show the estimates whatever the length of their intervals."""
    margin = 0.1 * (ends[1] - ends[0]) or 0.1 * abs(ends[0]) or 1.0
    return max(ends[0] - margin, 0.5 * ends[0]) if ends[0] > 0 else ends[0] - margin, ends[1] + margin


def save(figure: Figure | None, path: Path) -> None:
    """Write a picture, or none where there is nothing to show. Raises UserError where it cannot be written."""
    if figure is not None:
        write_figure(path, figure, dpi=150)
