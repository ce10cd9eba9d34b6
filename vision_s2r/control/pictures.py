"""The pictures of the experiments."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vision_s2r.control.config import ControlConfig
from vision_s2r.files import write_figure

DPI = 130
GREY = "0.85"
TICKS = (-50, -20, -10, -5, -2, -1, 0, 1, 2)  # % of the target


def follow(path: Path, cfg: ControlConfig, found: dict[str, Any]) -> Path:
    """Error against speed, error while damping drifts, and targets reached in every reality."""
    names = list(found["table"])
    realities = list(found["table"][names[0]])
    figure = Figure(figsize=(13, 4.5 + 0.28 * len(realities)), layout="constrained")
    heights = (4.5, 0.28 * len(realities) + 1)
    top, bottom = figure.subfigures(2, 1, height_ratios=heights)  # type: ignore[misc]  # an array of two
    speed, drift = top.subplots(1, 2)
    for k, name in enumerate(found["steady"]):
        _seeds(speed, np.array(found["speeds"]), found["steady"][name], name, k)
        count = len(found["drift"][name][0])
        _seeds(drift, np.linspace(0, cfg.drift.minutes, count + 1)[1:], found["drift"][name], name, k)
    speed.set(xlabel="target speed, rad/s", title="Speed held in reality")
    start = float(cfg.truth["viscous_damping"]["value"])
    drift.set(
        xlabel="minutes", title=f"{cfg.drift.speed:g} rad/s while damping grows from {start:g} to {cfg.drift.damping:g}"
    )
    for axes in (speed, drift):
        axes.axhspan(-100 * cfg.task.tolerance, 100 * cfg.task.tolerance, color=GREY, zorder=0)
        axes.set(ylabel="error, % of the target")
        axes.set_yscale("symlog", linthresh=2)
        axes.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    speed.legend(frameon=False, loc="lower right")
    _bars(bottom.subplots(), found["table"], realities, f"targets within {100 * cfg.task.tolerance:g} %")
    return write_figure(path, figure, DPI)


def _seeds(axes: Axes, x: np.ndarray, errors: list[list[float]], name: str, k: int) -> None:
    for seed, each in enumerate(errors):
        axes.plot(x, 100 * np.array(each), color=f"C{k}", lw=1.2, label=name if seed == 0 else None)


def _bars(axes: Axes, table: dict[str, dict[str, Any]], rows: list[str], title: str) -> None:
    height = 0.8 / len(table)
    for k, (name, row) in enumerate(table.items()):
        reached = [row[each]["reached"] for each in rows]
        value = 100 * np.array([each["value"] for each in reached])
        ends = 100 * np.array([[each["low"], each["high"]] for each in reached]).T
        at = np.arange(len(rows)) + (k - (len(table) - 1) / 2) * height
        axes.barh(at, value, height, color=f"C{k}", label=name)
        axes.errorbar(value, at, xerr=np.abs(ends - value), fmt="none", ecolor="0.2", lw=0.8)
    axes.set_yticks(np.arange(len(rows)), rows)
    axes.invert_yaxis()
    axes.set(xlabel=f"{title}, % (95 % intervals)", xlim=(0, 102))
    axes.grid(axis="x", alpha=0.3)
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1, 1))


def ablate(path: Path, rows: dict[str, Any]) -> Path:
    """Targets reached in reality by what was randomized in training."""
    figure = Figure(figsize=(9, 0.5 * len(rows) + 1), layout="constrained")
    axes = figure.subplots()
    value = np.array([100 * row["reached"]["value"] for row in rows.values()])
    ends = np.array([[100 * row["reached"][end] for row in rows.values()] for end in ("low", "high")])
    axes.barh(range(len(rows)), value, color=["C2", *["C0"] * (len(rows) - 2), "C3"])
    axes.errorbar(value, range(len(rows)), xerr=np.abs(ends - value), fmt="none", ecolor="0.2")
    axes.set_yticks(range(len(rows)), list(rows))
    axes.invert_yaxis()
    axes.set(xlabel="targets reached in reality, % (95 % intervals)", xlim=(0, 100))
    axes.grid(axis="x", alpha=0.3)
    return write_figure(path, figure, DPI)


def adr(path: Path, found: dict[str, Any]) -> Path:
    """Entropy and coverage over training, the ranges in the end, and what both policies reach."""
    figure = Figure(figsize=(13, 7.5), layout="constrained")
    grid = figure.subplots(2, 2)
    steps = np.array(found["steps"]) / 1e6
    for k, (entropy, covered) in enumerate(zip(found["entropy"], found["coverage"], strict=True)):
        grid[0, 0].plot(steps, [np.nan if each is None else each for each in entropy], color="C0", alpha=1 - 0.25 * k)
        grid[0, 1].plot(steps, 100 * np.array(covered), color="C0", alpha=1 - 0.25 * k, label=f"automatic, seed {k}")
    grid[0, 0].set(xlabel="million steps", ylabel="nats per dimension", title="Entropy of the ranges")
    grid[0, 1].axhline(100 * found["hand_picked_coverage"], color="C1", label="hand-picked")
    grid[0, 1].set(xlabel="million steps", ylabel="% of reality's box", title="Coverage of reality", ylim=(-3, 103))
    grid[0, 1].legend(frameon=False)
    _ranges(grid[1, 0], found)
    _bars(grid[1, 1], found["table"], list(next(iter(found["table"].values()))), "targets reached")
    for axes in grid[0]:
        axes.grid(alpha=0.3)
    return write_figure(path, figure, DPI)


def _ranges(axes: Axes, found: dict[str, Any]) -> None:
    """Each parameter on a line of its own, from 0 to the widest of its ranges."""
    names = [(name, key) for name, given in found["ranges"][0].items() for key in given]
    for row, (name, key) in enumerate(names):
        drawn = [each[name][key] for each in found["ranges"]]
        others = [found[kind].get(name, {}).get(key) for kind in ("hand_picked", "reality")]
        whole = max(high for low, high in [*drawn, *(each for each in others if isinstance(each, list))])
        for at, ends in enumerate(drawn):
            axes.plot(np.array(ends) / whole, [row - 0.1 - 0.06 * at] * 2, color="C0", lw=3, solid_capstyle="butt")
        for each, shift, colour in zip(others, (0.08, 0.2), ("C1", "0.4"), strict=True):
            if isinstance(each, list):
                axes.plot(np.array(each) / whole, [row + shift] * 2, color=colour, lw=3, solid_capstyle="butt")
        axes.annotate(f"{whole:.3g}", (1.01, row), va="center", fontsize=8)
    for label, colour in (("automatic", "C0"), ("hand-picked", "C1"), ("reality", "0.4")):
        axes.plot([], [], color=colour, lw=3, label=label)
    axes.set_yticks(range(len(names)), [name.replace("_", " ") for name, _ in names])
    axes.invert_yaxis()
    axes.set(xlabel="share of the largest value (right)", title="Ranges in the end", xlim=(0, 1.1))
    axes.legend(frameon=False, fontsize=8)
