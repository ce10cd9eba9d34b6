"""A report of a whole machine as a page."""

from collections.abc import Mapping
from typing import Any

from vision_s2r.report import words
from vision_s2r.report.page import environment

TEMPLATE = "robot.html"


def html(report: Mapping[str, Any]) -> str:
    """The page of a robot's report, whose parts' pages lie in folders of their names beside it."""
    return environment().get_template(TEMPLATE).render(report=report, sentence=sentence(report))


def sentence(report: Mapping[str, Any]) -> str:
    """Which part differs most, in units of its noise, and what it has."""
    if report["verdict"] == "no_gap":
        return "Simulator and recordings agree in every part, to measurement noise."
    worst = max(report["stages"], key=lambda stage: stage["share"])
    times = words.number(worst["gap"]["before"] / worst["gap"]["floor"]) if worst["gap"]["floor"] else "many"
    text = f"Furthest from the simulator is {worst['part']}: {times} times its measurement noise."
    named = [words.parameters(effect) for effect in report["effects"] if effect["part"] == worst["part"]]
    return f"{text} It has {words.listed(named)}." if named else f"{text} No known effect explains it."
