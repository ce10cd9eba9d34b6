"""Controllers that are tuned in a simulator: feedback and feed-forward to a drive's position command."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import differential_evolution

from vision_s2r.actuator.config import ActuatorTaskConfig
from vision_s2r.actuator.drive import Drive
from vision_s2r.actuator.log import GAINS, DriveLog, record
from vision_s2r.actuator.references import References, tasks

SETTLE = 0.2  # s from rest that do not count

# A simulator, or reality: loads with these payloads [N] (N·m), whose sensors' noise comes from the generator.
World = Callable[[np.ndarray, np.random.Generator], Drive]


def tune(world: World, cfg: ActuatorTaskConfig, sample_time: float, seed: int) -> np.ndarray:
    """Gains [5], as GAINS names them, that follow tasks of their own best in this world.

    Differential evolution (Storn and Price 1997). The cost is the RMS error (rad), plus `roughness` times the RMS
    change of the command between samples (rad), in the mean over tasks. The same seed gives the same gains.
    """
    given = tasks(cfg, cfg.tuned_on, sample_time, np.random.default_rng([seed, 0]))

    def cost(candidates: np.ndarray) -> np.ndarray:  # [5, S] to [S]
        references = given.tiled(candidates.shape[1])
        drive = world(references.payload, np.random.default_rng([seed, 1]))
        log = record(drive, references, np.repeat(candidates.T, cfg.tuned_on, axis=0))
        change = np.sqrt(np.mean(np.diff(log.command, axis=1) ** 2, axis=1))
        return (rms_error(log, sample_time) + cfg.roughness * change).reshape(-1, cfg.tuned_on).mean(axis=1)

    found = differential_evolution(
        cost, list(GAINS.values()), popsize=cfg.population, maxiter=cfg.generations, rng=seed,
        vectorized=True, updating="deferred", polish=False, tol=0,
    )  # fmt: skip
    return found.x


def rms_error(log: DriveLog, sample_time: float) -> np.ndarray:
    """RMS over time [N] (rad) of the reference less the true position, once settled."""
    return np.sqrt(np.mean(log.miss[:, round(SETTLE / sample_time) :] ** 2, axis=1))


def attempt(world: World, references: References, gains: np.ndarray, seed: int) -> DriveLog:
    """A controller with these gains [5] on each reference."""
    drive = world(references.payload, np.random.default_rng([seed, 2]))
    return record(drive, references, np.repeat(gains[None], len(drive), axis=0))
