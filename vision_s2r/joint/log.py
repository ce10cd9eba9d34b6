"""What an episode gives to a simulation, and how its samples are divided."""

import math
from typing import NamedTuple

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.pointer import Pointer


class JointLog(NamedTuple):
    """The episode that is simulated; compiled code reads it."""

    samples: int  # T
    command: Pointer  # [T] held between samples
    first: tuple[float, float]  # position and velocity
    observed: Pointer  # [T, 2] where leak is not 0
    leak: float
    sample_time: float
    substeps: int
    times: Pointer  # [T] s from the first sample, where they are not every `sample_time`
    given: tuple[bool, bool, bool]  # whether there are the following
    scale: Pointer  # [T] factor of u, held between samples
    parts: int  # into which a sample is cut by the following
    external: Pointer  # [T · parts] torque on the load, each held for its part of a sample
    load_inertia: Pointer  # [T · parts] added to the machine's, alike


@compiled
def segments(fraction: float, sample_time: float, substeps: int) -> tuple[tuple[int, int], tuple[float, float]]:
    """Steps, and their length, before and after the command changes, `fraction` seconds into a sample."""
    rest = sample_time - fraction
    before = math.ceil(substeps * fraction / sample_time)
    after = max(math.ceil(substeps * rest / sample_time - 1e-9), 1)
    return (before, after), (fraction / max(before, 1), rest / after)


@compiled
def sent(command: Pointer, sample: int) -> float:
    """The command of a sample, none before the first."""
    return command[sample] if sample >= 0 else 0.0


@compiled
def correction(leak: float, observed: float, simulated: float) -> float:
    """What an observer adds; nothing where nothing was observed."""
    return 0.0 if math.isnan(observed) else leak * (observed - simulated)
