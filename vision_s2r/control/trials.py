"""Policies tried on machines, and what that amounts to."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from vision_s2r.control.config import ControlConfig
from vision_s2r.control.machines import Controller, Machines
from vision_s2r.control.tracking import track
from vision_s2r.control.training_jobs import nominal_of
from vision_s2r.statistics import Bootstrap, Estimate


def tried(cfg: ControlConfig, some: Sequence[Controller], machines: Machines, wanted: np.ndarray) -> np.ndarray:
    """Errors [seeds, N, T] of controllers on the same machines and targets [N, T] (rad/s)."""
    return np.stack([track(each, cfg.task, nominal_of(cfg), machines, wanted, cfg.seed) for each in some])


def summary(cfg: ControlConfig, errors: np.ndarray) -> dict[str, Any]:
    """What errors [seeds, N, T] amount to; targets on one machine depend on each other little, seeds do."""
    flat = np.abs(errors).reshape(len(errors), -1)
    estimate = Bootstrap(flat.shape[1], cfg.seed).success(flat < cfg.task.tolerance)
    return {"reached": asdict(estimate), "targets": flat.size, "error": float(flat.mean())}


def regret(cfg: ControlConfig, best: np.ndarray, errors: np.ndarray) -> Estimate:
    """How many more of the same targets are reached with errors `best` than with `errors`, [seeds, N, T] each."""
    first, second = (np.abs(each).reshape(len(each), -1) < cfg.task.tolerance for each in (best, errors))
    return Bootstrap(first.shape[1], cfg.seed).difference(first, second)
