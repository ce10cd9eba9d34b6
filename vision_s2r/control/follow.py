"""The experiment: what randomized training is worth in reality, where the simulator is wrong."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from vision_s2r import files
from vision_s2r.control import pictures
from vision_s2r.control.config import ControlConfig, check
from vision_s2r.control.machines import Controller, Given
from vision_s2r.control.policy import OpenLoop
from vision_s2r.control.realities import realities, targets
from vision_s2r.control.training_jobs import nominal_of, trained
from vision_s2r.control.trials import show, summary, tried
from vision_s2r.progress import tracked

MINUTE = 60.0  # s
HELD = 2.0  # s, long enough for any transient to be over
SPEEDS = 29  # from the lowest to the highest


def follow(cfg: ControlConfig) -> Path:
    """Train the policies and try each, beside the open-loop inverse, in every reality; the picture's path.

    follow.json has by controller and reality: `reached`, the share of targets within the task's tolerance with its 95 %
    interval, `targets` their number, and `error`, the mean of the absolute relative error; `steady`, by controller, the
    signed errors [seeds, speeds] once every transient is over; `drift`, the same [seeds, minutes].
    """
    check(cfg)
    controllers: dict[str, list[Controller]] = {"open loop": [OpenLoop(nominal_of(cfg), cfg.task)]}
    controllers.update(trained(cfg, cfg.policies, cfg.seeds, cfg.training.steps))  # type: ignore[arg-type]
    found = {
        "table": _table(cfg, controllers),
        "speeds": _speeds(cfg).tolist(),
        "steady": {name: _steady(cfg, some).tolist() for name, some in controllers.items()},
        "drift": {name: _drift(cfg, some).tolist() for name, some in controllers.items()},
    }
    out = Path(cfg.out)
    files.write(out / "follow.json", json.dumps(found, indent=1))
    _print(found["table"])
    return pictures.follow(out / "follow.png", cfg, found)


def _table(cfg: ControlConfig, controllers: Mapping[str, list[Controller]]) -> dict[str, dict[str, Any]]:
    rows: dict[str, dict[str, Any]] = {name: {} for name in controllers}
    every = realities(cfg)
    for reality in tracked(every, len(every), "realities"):
        wanted = targets(cfg.task, reality.count, cfg.seed)
        for name, some in controllers.items():
            rows[name][reality.name] = summary(cfg, tried(cfg, some, Given(reality.effects), wanted))
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


def _print(rows: dict[str, dict[str, Any]]) -> None:
    table = Table("reality", *rows, title="targets reached, % [95 %]; mean error")
    for reality in next(iter(rows.values())):
        cells = (row[reality] for row in rows.values())
        table.add_row(reality, *(show(cell) for cell in cells))
    Console(width=160).print(table)
