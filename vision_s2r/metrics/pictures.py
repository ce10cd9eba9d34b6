"""The figures."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vision_s2r.files import write_figure
from vision_s2r.metrics.report import Report

DPI = 120
ACROSS = 4  # panels
MARKERS = "osD^vP*XhH<>pd"
ERRORS = {
    "dropped": "dropped, of the objects",
    "invented": "invented, a scene",
    "moved": "moved, of those kept",
    "recoloured": "recoloured, of the objects",
}


def scatter(report: Report, path: Path) -> Path:
    """Success over each metric: a point a training seed and column, a colour a row, a marker a column."""
    rows, columns = report.rows, list(dict.fromkeys(point.column for point in report.points))
    down = -(-len(report.correlations) // ACROSS)
    figure = Figure(figsize=(3.1 * ACROSS, 2.7 * down + 0.6), layout="constrained")
    panels = figure.subplots(down, ACROSS, sharey=True, squeeze=False).ravel()
    for axes, each in zip(panels, report.correlations, strict=False):
        for point in report.points:
            axes.plot(
                point.value(each.metric),
                100 * point.success.mean(),
                marker=MARKERS[columns.index(point.column) % len(MARKERS)],
                color=f"C{rows.index(point.row)}",
                linestyle="",
                alpha=0.75,
            )
        title = f"ρ = {each.overall.value:.2f}, within columns {each.within_columns.value:.2f}"
        axes.set_title(title.replace("nan", "–"), fontsize=9)
        axes.set_xlabel(each.metric.replace("_", " "))
        axes.grid(alpha=0.3)
    for axes in panels[len(report.correlations) :]:
        axes.remove()
    for axes in panels[::ACROSS]:
        axes.set_ylabel("success, %")
    first = panels[0]
    handles = [first.plot([], [], "s", color=f"C{k}", label=row)[0] for k, row in enumerate(rows)]
    handles += [
        first.plot([], [], MARKERS[k % len(MARKERS)], color="0.4", label=column)[0] for k, column in enumerate(columns)
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=8, frameon=False, fontsize=8)
    return write_figure(path, figure, DPI)


def objects(report: Report, path: Path) -> Path:
    """How often each row drops, invents, moves and recolours, over all columns, with intervals."""
    figure = Figure(figsize=(8, 3.4), layout="constrained")
    axes = figure.subplots()
    width = 0.8 / len(report.rows)
    for k, row in enumerate(report.rows):
        at = np.arange(len(ERRORS)) + (k - (len(report.rows) - 1) / 2) * width
        found = [report.overall(row, metric) for metric in ERRORS]
        value, low, high = (np.array([getattr(each, end) for each in found]) for end in ("value", "low", "high"))
        axes.bar(at, value, width, color=f"C{k}", label=row)
        axes.errorbar(at, value, yerr=np.abs([low - value, high - value]), fmt="none", ecolor="0.2", lw=1, capsize=2)
    axes.set_xticks(range(len(ERRORS)), list(ERRORS.values()), fontsize=9)
    axes.set_ylabel("rate, all columns")
    axes.grid(axis="y", alpha=0.3)
    axes.legend(frameon=False, fontsize=8)
    return write_figure(path, figure, DPI)
