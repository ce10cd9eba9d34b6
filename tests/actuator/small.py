"""Drives and logs of the tests' size."""

import numpy as np

from vision_s2r.actuator.config import DriveConfig, LogsConfig
from vision_s2r.actuator.drive import MotorDrive
from vision_s2r.actuator.log import LooseLoop, record
from vision_s2r.actuator.references import sweeps

EFFECTS = {
    "backlash": {"width": 0.005},
    "latency": {"delay": 0.015},
    "torque_speed_limit": {"stall": 0.7, "no_load_speed": 10.0},
}
ANALYTIC = {"torque_saturation": {"limit": 0.7}}
NOTHING = LooseLoop(np.zeros(1), np.zeros(1))
QUIET = {"position_noise": 0.0, "velocity_noise": 0.0, "torque_noise": 0.0}


def rng(seed=0):
    return np.random.default_rng(seed)


def logged(cfg, motions, seed, effects=None, seconds=2.0):
    """Motions, without an outer loop."""
    references = sweeps(LogsConfig(seconds=seconds), motions, cfg.sample_time, rng(seed))
    return record(MotorDrive(cfg, references.payload, rng(seed + 1), effects), references, NOTHING)


def drive(**changes):
    return DriveConfig(**{"effects": EFFECTS, **changes})
