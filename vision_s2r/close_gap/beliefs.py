"""What each row believes of a robot: nothing, everything at once, what was diagnosed, or the truth."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.camera import CAMERA_EFFECTS, CameraConfig
from vision_s2r.close_gap.withheld import everything
from vision_s2r.scene.drives import Tuning
from vision_s2r.scene.machine import CONTACTS, DRIVES, REFERENCE_SIZE, Machine, registry_of

Report = Mapping[str, Any]


@dataclass(frozen=True)
class Belief:
    """A camera to train the translator under, and robots that grasps are tried on."""

    camera: CameraConfig
    robots: list[Machine] = field(default_factory=list)

    @property
    def tuning(self) -> Tuning:
        """What a controller makes of it."""
        return Tuning(tuple(robot.drives for robot in self.robots))


def known(robot: Machine) -> Belief:
    """One robot, as it is."""
    return Belief(robot.camera, [robot])


def blind(camera: CameraConfig, draws: int, seed: int) -> Belief:
    """Everything randomized widely, by a camera's preset and drawn robots."""
    return Belief(camera, everything(draws, seed))


def diagnosed(report: Report) -> Machine:
    """The robot that a report of a robot, or of its camera, tells of."""
    parts: dict[str, dict[str, dict[str, float]]] = {}
    for part, effect in _effects(report):
        values = {key: float(given["value"]) for key, given in effect["parameters"].items()}
        parts.setdefault(part, {})[effect["name"]] = values
    return Machine(parts)


def posterior(report: Report, draws: int, seed: int) -> Belief:
    """The same, every parameter drawn from its 95 % interval."""
    rng = np.random.default_rng([seed, draws])
    camera: dict[str, dict[str, Any]] = {}
    robots: list[dict[str, dict[str, dict[str, float]]]] = [{} for _ in range(draws)]
    for part, effect in _effects(report):
        ends = {key: _within(part, effect["name"], key, given["ci"]) for key, given in effect["parameters"].items()}
        if part == "camera":
            camera[effect["name"]] = {key: list(pair) for key, pair in ends.items()}
        for robot in robots:
            drawn = {key: float(rng.uniform(*pair)) for key, pair in ends.items()}
            robot.setdefault(part, {})[effect["name"]] = drawn
    return Belief(CameraConfig(effects=camera, reference_size=REFERENCE_SIZE), [Machine(robot) for robot in robots])


def _within(part: str, name: str, key: str, ci: list[float]) -> tuple[float, float]:
    """An interval without what cannot be."""
    parameter = registry_of(part)[name].parameter(key)
    low, high = (float(np.clip(end, parameter.low, parameter.high)) for end in ci)
    return low, high


def _effects(report: Report) -> list[tuple[str, dict[str, Any]]]:
    """(part of the robot, effect) of those that the scene simulates."""
    found = []
    for effect in report["effects"]:
        part = Path(str(effect.get("part", report["kind"]))).name
        simulated = {
            "camera": effect["name"] in CAMERA_EFFECTS,
            "contact": effect["name"] in CONTACTS,
        }.get(part, part in DRIVES)
        if simulated:
            found.append((part, effect))
    return found
