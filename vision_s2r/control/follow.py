"""The experiment: what randomized training is worth in reality, where the simulator is wrong."""

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r import files, results
from vision_s2r.control import pictures, report
from vision_s2r.control.config import ControlConfig, PolicyConfig, check
from vision_s2r.control.machines import Controller, Given
from vision_s2r.control.planner import ceiling
from vision_s2r.control.policy import OpenLoop
from vision_s2r.control.realities import realities, targets
from vision_s2r.control.report import CEILING
from vision_s2r.control.training_jobs import nominal_of, trained
from vision_s2r.control.trials import regret, summary, tried
from vision_s2r.errors import UserError, nearest
from vision_s2r.progress import tracked

MINUTE = 60.0  # s
HELD = 2.0  # s, long enough for any transient to be over
SPEEDS = 29  # from the lowest to the highest


def follow(cfg: ControlConfig) -> Path:
    """Train the policies and try each, beside the open-loop inverse, in every reality; the picture's path.

    follow.json has by controller and reality: `reached`, the share of targets within the task's tolerance with its 95 %
    interval, `targets` their number, `error`, the mean of the absolute relative error, and `regret`, the share reached
    by the "ceiling", a controller that knows the machine, less its own; `steady`, by controller, the signed errors
    [seeds, speeds] once every transient is over; `drift`, the same [seeds, minutes]; `columns` and `rows`, all of this
    as a table.
    """
    check(cfg)
    controllers: dict[str, list[Controller]] = {"open loop": [OpenLoop(nominal_of(cfg), cfg.task)]}
    controllers.update(trained(cfg, _chosen(cfg), cfg.seeds))  # type: ignore[arg-type]
    found = {
        "table": _table(cfg, controllers),
        "speeds": _speeds(cfg).tolist(),
        "steady": {name: _steady(cfg, some).tolist() for name, some in controllers.items()},
        "drift": {name: _drift(cfg, some).tolist() for name, some in controllers.items()},
    }
    found |= report.follow(cfg, found)
    out = Path(cfg.out)
    files.write(out / "follow.json", json.dumps(found, indent=1))
    results.show(found)
    return pictures.follow(out / "follow.png", cfg, found)


def _chosen(cfg: ControlConfig) -> dict[str, PolicyConfig]:
    for name in cfg.only:
        if name not in cfg.policies:
            raise UserError(f"only: no policy '{name}', {nearest(name, cfg.policies)}")
    return {name: cfg.policies[name] for name in cfg.only or cfg.policies}


def _table(cfg: ControlConfig, controllers: Mapping[str, list[Controller]]) -> dict[str, dict[str, Any]]:
    rows: dict[str, dict[str, Any]] = {name: {} for name in (*controllers, CEILING)}
    every = realities(cfg)
    for reality in tracked(every, len(every), "realities"):
        wanted = targets(cfg.task, reality.count, cfg.seed)
        machines = Given(reality.effects)
        best = ceiling(cfg.task, nominal_of(cfg), machines, wanted, cfg.ceiling, cfg.seed)[None]
        rows[CEILING][reality.name] = summary(cfg, best)
        for name, some in controllers.items():
            errors = tried(cfg, some, machines, wanted)
            rows[name][reality.name] = summary(cfg, errors) | {"regret": asdict(regret(cfg, best, errors))}
    return rows


def _speeds(cfg: ControlConfig) -> np.ndarray:
    return np.linspace(cfg.task.lowest, cfg.task.highest, SPEEDS)


def _steady(cfg: ControlConfig, some: list[Controller]) -> np.ndarray:
    """Errors [seeds, speeds] after a while at one speed."""
    held = replace(cfg, task=replace(cfg.task, hold=HELD, targets=1))
    return tried(held, some, Given(cfg.truth), _speeds(cfg)[:, None])[..., 0]


def _drift(cfg: ControlConfig, some: list[Controller]) -> np.ndarray:
    """Errors [seeds, minutes] while damping drifts, at the end of each minute, or of each 60th of a shorter run."""
    drift, count = cfg.drift, 60
    whole = drift.minutes * MINUTE
    start = float(cfg.truth["viscous_damping"]["value"])
    effects = {**cfg.truth, "thermal_drift": {"rate": (drift.damping / start - 1) / whole}}
    held = replace(cfg, task=replace(cfg.task, hold=whole / count, targets=count))
    wanted = np.full((1, count), drift.speed)
    return tried(held, some, Given(effects), wanted)[:, 0]
