"""Figures of plain arrays."""

import base64
import html as text
import io
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

INK, BEFORE, AFTER, FLOOR = "#1f2328", "#d1495b", "#2e7d8c", "#8c959f"
WIDTH = 10.0  # inches
DPI = 110
Panel = Mapping[str, np.ndarray]  # measured, before, after


class Figures(dict[str, Figure]):
    """Figures by caption. A notebook shows them all."""

    def _repr_html_(self) -> str:
        shown = [(text.escape(caption), base64.b64encode(png(figure)).decode()) for caption, figure in self.items()]
        return "".join(f'<p>{caption}</p><img src="data:image/png;base64,{content}">' for caption, content in shown)


def series(t: np.ndarray, panels: Mapping[str, Panel]) -> Figure:
    """Panels over a common time `t` [T] (s), by label ("velocity, rad/s"): measured, before and after [T] of each."""
    figure, axes = canvas(len(panels), 1, 2.6 * len(panels), sharex=True)
    for axis, (label, panel) in zip(axes.flat, panels.items(), strict=True):
        axis.plot(t, panel["measured"], color=INK, linewidth=2.4, alpha=0.35, label="measured")
        axis.plot(t, panel["before"], color=BEFORE, linewidth=1.1, label="simulator")
        axis.plot(t, panel["after"], color=AFTER, linewidth=1.1, label="simulator with the effects found")
        axis.set_ylabel(label)
        plain(axis)
    axes.flat[0].legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2)
    axes.flat[-1].set_xlabel("t, s")
    return figure


def heights(
    t: np.ndarray, lines: Mapping[str, np.ndarray], least: float, spans: Sequence[tuple[float, float]]
) -> Figure:
    """Measured and simulated heights [T] (m) over time `t` [T] (s), one of them marked, and spans of time shaded."""
    figure, axes = canvas(1, 1, 3.2)
    axis = axes[0, 0]
    for start, end in spans:
        axis.axvspan(start, end, color=FLOOR, alpha=0.2, linewidth=0)
    axis.plot(t, lines["measured"], color=INK, linewidth=2.4, alpha=0.35, label="measured")
    axis.plot(t, lines["simulated"], color=AFTER, linewidth=1.1, label="simulator")
    axis.axhline(least, color=BEFORE, linewidth=0.8, linestyle="--", label="where it touches")
    axis.set_ylabel("height of the tip, m")
    axis.set_xlabel("t, s")
    plain(axis)
    axis.legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2)
    return figure


def by_bin(unit: str, parts: Sequence[tuple[str, Sequence[str], np.ndarray, np.ndarray, np.ndarray]]) -> Figure:
    """Bars of the gap by bin, a panel an axis: its name, labels, before, after and floor [bins] (NaN: no samples)."""
    columns = min(len(parts), 2)
    rows = -(-len(parts) // columns)
    heights = [0.7 + 0.3 * max(len(labels) for _, labels, *_ in row) for row in _rows(parts, columns)]
    figure, axes = canvas(rows, columns, sum(heights), height_ratios=heights)
    for axis, (name, labels, before, after, floor) in zip(axes.flat, parts, strict=False):
        at = np.arange(len(labels))
        axis.barh(at - 0.19, before, 0.36, color=BEFORE, label="before")
        axis.barh(at + 0.19, after, 0.36, color=AFTER, label="after")
        for y, x in zip(at, floor, strict=True):
            axis.plot([x, x], [y - 0.42, y + 0.42], color=INK, linewidth=1.2, label="noise" if y == 0 else None)
        axis.set_yticks(at, labels, fontsize=8)
        axis.set_ylim(len(labels) - 0.4, -0.6)
        axis.set_title(name.replace("_", " "), fontsize=10, loc="left")
        axis.set_xlabel(unit, fontsize=8)
        axis.xaxis.set_major_locator(MaxNLocator(5))
        plain(axis)
    for axis in list(axes.flat)[len(parts) :]:
        axis.remove()
    handles, names = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, names, frameon=False, fontsize=8, ncols=3, loc="outside upper right")
    return figure


def strips(columns: Mapping[str, Sequence[np.ndarray]], residuals: Mapping[str, Sequence[np.ndarray]]) -> Figure:
    """Rows of pictures: columns of [H, W, 3] in [0, 1] by title, then of signed residuals [H, W, 3], around grey."""
    titles = [*columns, *residuals]
    rows = max(len(pictures) for pictures in columns.values())
    height, width = next(iter(columns.values()))[0].shape[:2]
    figure, axes = canvas(rows, len(titles), 0.3 + rows * WIDTH / len(titles) * height / width)
    spread = [np.abs(each).ravel() for pictures in residuals.values() for each in pictures]
    limit = max(float(np.quantile(np.concatenate(spread), 0.99)), 4 / 255) if spread else 1.0
    for column, title in enumerate(titles):
        for row in range(rows):
            axis = axes[row, column]
            axis.set_axis_off()
            if title in columns:
                axis.imshow(np.clip(columns[title][row], 0, 1), interpolation="nearest")
            else:
                axis.imshow(np.clip(0.5 + residuals[title][row] / (2 * limit), 0, 1), interpolation="nearest")
            if row == 0:
                axis.set_title(title, fontsize=9, loc="left")
    return figure


def maps(unit: str, panels: Mapping[str, np.ndarray]) -> Figure:
    """Maps [rows, columns] of the picture, by title, on one scale."""
    figure, axes = canvas(1, len(panels), 3.4)
    top = max(float(np.nanmax(values)) for values in panels.values())
    for axis, (title, values) in zip(axes.flat, panels.items(), strict=True):
        image = axis.imshow(values, vmin=0, vmax=top, cmap="magma")
        axis.set_title(title, fontsize=10, loc="left")
        axis.set_xticks([])
        axis.set_yticks([])
    figure.colorbar(image, ax=axes, label=unit, shrink=0.9)
    return figure


def _rows(items: Sequence[Any], columns: int) -> list[Sequence[Any]]:
    return [items[k : k + columns] for k in range(0, len(items), columns)]


def canvas(rows: int, columns: int, height: float, **keys: Any) -> tuple[Figure, np.ndarray]:
    """A figure of this height (inches) and its axes [rows, columns]; `keys` are those of `Figure.subplots`."""
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **keys)


def plain(axis: Axes) -> None:
    """Two spines less, small labels."""
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(labelsize=8)
    axis.margins(x=0.01)


@lru_cache(maxsize=4)  # a page and a file beside it show the same
def png(figure: Figure) -> bytes:
    """A finished figure as a PNG, the same bytes every time."""
    content = io.BytesIO()
    figure.savefig(content, format="png", metadata={"Software": None})
    return content.getvalue()
