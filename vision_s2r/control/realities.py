"""Realities that controllers are tried in: machines that the simulator does not know of."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from vision_s2r.control.config import ControlConfig, ControlTaskConfig
from vision_s2r.control.effects import CONTROL_EFFECTS
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.randomize import effect_ranges

EPISODES = 8  # of each machine

Effects = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Reality:
    """Machines in a row, effects by name, parameters by name, each a number or an array [N]."""

    name: str
    effects: Effects
    count: int


def realities(cfg: ControlConfig) -> list[Reality]:
    """Reality as it is, each end of the randomized ranges, other payloads, and each unmodelled effect beside."""
    found = [Reality("reality", cfg.truth, EPISODES)]
    found += [edges(cfg.edges)] if cfg.edges else []
    for payload in cfg.payloads:
        heavier = {**cfg.truth, "inertia": {"value": payload * cfg.nominal.inertia}}
        found.append(Reality(f"inertia × {payload:g}", heavier, EPISODES))
    for effect in JOINT_EFFECTS:
        if effect.source == "actuator" and not effect.servo:
            found.append(Reality(effect.name, {**cfg.truth, effect.name: effect.moderate()}, EPISODES))
    return found


def edges(effects: Effects) -> Reality:
    """Every corner of the box of these ranges, EPISODES times."""
    drawn = effect_ranges(effects, CONTROL_EFFECTS)
    ends = {(name, key): list(each) for name, given in drawn.items() for key, each in given.ranges.items()}
    corners = np.repeat(np.array(list(product(*ends.values())), float), EPISODES, axis=0)
    found: dict[str, dict[str, np.ndarray]] = {}
    for (name, key), column in zip(ends, corners.T, strict=True):
        found.setdefault(name, {})[key] = column
    return Reality("edges of the ranges", found, len(corners))


def targets(task: ControlTaskConfig, count: int, seed: int) -> np.ndarray:
    """Target speeds [count, T], the same for every controller; of another random stream than training's."""
    rng = np.random.default_rng([seed, 1])
    return rng.uniform(task.lowest, task.highest, (count, task.targets)) * rng.choice([-1, 1], (count, task.targets))
