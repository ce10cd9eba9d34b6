"""The ceiling: what a controller reaches that knows the machine, its state and its future, and may think for long."""

import numpy as np

from vision_s2r.control.config import CeilingConfig, ControlTaskConfig, held_samples
from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import Machines
from vision_s2r.joint import Joints, NominalJoint


def ceiling(
    task: ControlTaskConfig,
    nominal: NominalJoint,
    machines: Machines,
    targets: np.ndarray,
    cfg: CeilingConfig,
    seed: int = 0,
) -> np.ndarray:
    """Errors [N, T], as `track` has them, of currents that are planned on copies of the very machine.

    The plan for a target is the best that the cross-entropy method finds for the time that it is held, from the state
    in which the last one left the joint; the next target is not foreseen. What it misses, a better search may find:
    the true ceiling is no lower.
    """
    environment = SpeedTracking(task, nominal, machines, len(targets), 0, seed)
    environment.reset(options={"targets": targets})
    rng = np.random.default_rng([seed, 2])
    info: dict[str, np.ndarray] = {}
    for target in targets.T:
        for sent in _plan(environment.joints, target, task, cfg, rng).T:
            *_, info = environment.step(sent[:, None])
    return info["errors"]


def _plan(
    joints: Joints, target: np.ndarray, task: ControlTaskConfig, cfg: CeilingConfig, rng: np.random.Generator
) -> np.ndarray:
    """Commands [N, samples] in [-1, 1] for the time that a target [N] is held."""
    count, samples = len(joints), held_samples(task)
    mean, spread = np.zeros((count, cfg.knots)), np.ones((count, cfg.knots))
    best, lowest = mean, np.full(count, np.inf)
    for _ in range(cfg.iterations):
        drawn = mean[:, None] + spread[:, None] * rng.standard_normal((count, cfg.samples, cfg.knots))
        drawn[:, 0] = mean
        drawn = np.clip(drawn, -1, 1)
        cost = _cost(joints, _interpolated(drawn, samples), target, task)
        order = np.argsort(cost, axis=1)[:, : cfg.elites]
        elites = np.take_along_axis(drawn, order[..., None], axis=1)
        mean, spread = elites.mean(axis=1), elites.std(axis=1)
        first = np.take_along_axis(cost, order[:, :1], axis=1)[:, 0]
        best = np.where((first < lowest)[:, None], elites[:, 0], best)
        lowest = np.minimum(first, lowest)
    return _interpolated(best, samples)


def _interpolated(knots: np.ndarray, samples: int) -> np.ndarray:
    """Commands [..., samples], straight between knots [..., K]."""
    at = np.linspace(0, knots.shape[-1] - 1, samples)
    left = np.minimum(at.astype(int), knots.shape[-1] - 2)
    share = at - left
    return knots[..., left] * (1 - share) + knots[..., left + 1] * share


def _cost(joints: Joints, commands: np.ndarray, target: np.ndarray, task: ControlTaskConfig) -> np.ndarray:
    """Of each row of commands [N, K, samples]: what counts, the mean speed's error, and a little for every other."""
    count, rows, samples = commands.shape
    copies = joints.take(np.repeat(np.arange(count), rows))
    wanted = np.repeat(target, rows)
    settled = round(task.settled / task.sample_time)
    mean, deviation = np.zeros(len(wanted)), np.zeros(len(wanted))
    for k in range(samples):
        copies.step(commands[:, :, k].ravel() * task.max_current)
        error = copies.true[:, 1] / wanted - 1
        if k >= samples - settled:
            mean += error / settled
            deviation += 0.1 * np.abs(error) / settled
    return (np.abs(mean) + deviation).reshape(count, rows)
