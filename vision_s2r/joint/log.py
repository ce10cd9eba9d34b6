"""What an episode gives to a simulation, and how its samples are divided."""

import math
from typing import NamedTuple

import numpy as np

from vision_s2r.joint.compiled import compiled


class JointLog(NamedTuple):
    """The episode that is simulated; compiled code reads it."""

    command: np.ndarray  # [T] held between samples
    first: np.ndarray  # [2] position and velocity
    observed: np.ndarray  # [T, 2], or empty where leak is 0
    leak: float
    sample_time: float
    substeps: int
    times: np.ndarray  # [T] s from the first sample, or empty: every `sample_time`
    scale: np.ndarray  # [T] factor of u, held between samples, or empty: 1
    external: np.ndarray  # [T] torque on the load, held between samples, or empty: none
    load_inertia: np.ndarray  # [T] added to the machine's, held between samples, or empty: none


@compiled
def segments(fraction: float, sample_time: float, substeps: int) -> tuple[tuple[int, int], tuple[float, float]]:
    """Steps, and their length, before and after the command changes, `fraction` seconds into a sample."""
    rest = sample_time - fraction
    before = math.ceil(substeps * fraction / sample_time)
    after = max(math.ceil(substeps * rest / sample_time - 1e-9), 1)
    return (before, after), (fraction / max(before, 1), rest / after)


@compiled
def sent(command: np.ndarray, sample: int) -> float:
    """The command of a sample, none before the first."""
    return command[sample] if sample >= 0 else 0.0


@compiled
def correction(leak: float, observed: float, simulated: float) -> float:
    """What an observer adds; nothing where nothing was observed."""
    return 0.0 if math.isnan(observed) else leak * (observed - simulated)
