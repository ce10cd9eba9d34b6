"""A report of a whole machine as a page."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from vision_s2r.report import words
from vision_s2r.report.drawing import AFTER, BEFORE, FLOOR, INK, canvas, plain
from vision_s2r.report.page import environment

TEMPLATE = "robot.html"


def html(report: Mapping[str, Any]) -> str:
    """The page of a robot's report, whose parts' pages lie in folders of their names beside it."""
    lost = losses_of(report)
    return (
        environment()
        .get_template(TEMPLATE)
        .render(report=report, sentence=sentence(report), lost=lost, waterfall=waterfall(lost) if lost else None)
    )


def losses_of(report: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """What the robot's effects cost its task, where that was measured."""
    lost: Mapping[str, Any] | None = report.get("task", {}).get("losses")
    return lost


def sentence(report: Mapping[str, Any]) -> str:
    """What to mend first, where its cost was measured; else which part differs most, in units of its noise."""
    lost = losses_of(report)
    if lost:
        return _mend(lost, report)
    if report["verdict"] == "no_gap":
        return "Simulator and recordings agree in every part, to measurement noise."
    worst = max(report["stages"], key=lambda stage: stage["share"])
    times = words.number(worst["gap"]["before"] / worst["gap"]["floor"]) if worst["gap"]["floor"] else "many"
    text = f"Furthest from the simulator is {worst['part']}: {times} times its measurement noise."
    named = [words.parameters(effect) for effect in report["effects"] if effect["part"] == worst["part"]]
    return f"{text} It has {words.listed(named)}." if named else f"{text} No known effect explains it."


def _mend(lost: Mapping[str, Any], report: Mapping[str, Any]) -> str:
    first = max(lost["sources"], key=lambda source: source["gained"])
    if first["gained_ci"][0] <= 0:
        return f"Nothing to mend: of {lost['scenes']} grasps no source costs more than chance does."
    text = f"Mend the {first['source']} first: without its effects the robot holds {_points(first['gained'])} points"
    low, high = first["gained_ci"]
    named = [words.parameters(effect) for effect in report["effects"] if _source(effect) == first["source"]]
    has = f" It has {words.listed(named)}." if named else ""
    return f"{text} ({_points(low)} to {_points(high)}) more of its grasps.{has}"


def _source(effect: Mapping[str, Any]) -> str:
    part = str(effect["part"])
    return part if part in ("camera", "contact") else "drives"


def _points(share: float) -> str:
    return f"{100 * share:.0f}"


def waterfall(lost: Mapping[str, Any]) -> Figure:
    """From success in simulation down to success in reality, a bar for what each source takes, with 95 %."""
    sources = sorted(lost["sources"], key=lambda source: -source["lost"])
    figure, axes = canvas(1, 1, 3.4)
    (axis,) = axes.flat
    axis.bar(0, 100 * lost["simulated"], 0.62, color=AFTER)
    level, tops = lost["simulated"], [lost["simulated"]]
    for k, source in enumerate(sources, start=1):
        after = level - source["lost"]
        axis.bar(k, 100 * source["lost"], 0.62, bottom=100 * after, color=BEFORE if source["lost"] > 0 else FLOOR)
        ends = [100 * (level - end) for end in source["lost_ci"]]
        axis.plot([k, k], ends, color=INK, linewidth=1.2)
        axis.plot([k - 1, k], [100 * level] * 2, color=INK, linewidth=0.6, linestyle=":")
        tops.append(max(level, after, *(end / 100 for end in ends)))
        level = after
    axis.bar(len(sources) + 1, 100 * lost["real"], 0.62, color=INK)
    tops.append(lost["real"])
    signs = [
        f"{100 * lost['simulated']:.0f} %",
        *(f"{-100 * s['lost']:+.0f}" for s in sources),
        f"{100 * lost['real']:.0f} %",
    ]
    for k, (top, sign) in enumerate(zip(tops, signs, strict=True)):
        axis.annotate(sign, (k, 100 * top), (0, 3), textcoords="offset points", ha="center", fontsize=9)
    labels = ["in simulation", *(source["source"] for source in sources), "in reality"]
    axis.set_xticks(range(len(labels)), labels)
    axis.set_ylabel("grasps held, %")
    axis.set_ylim(0, 105)
    plain(axis)
    return figure
