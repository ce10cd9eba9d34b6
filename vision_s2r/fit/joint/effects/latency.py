"""How a delay of the command is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack

LONG, BUS = 0.1, (0.0015, 0.005, 0.015, 0.03, 0.06)  # s


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    return [linear("delay", 0.0, max(20 * track.sample_time, 0.1), 10 * track.sample_time)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    samples = [x * track.sample_time for x in (0.3, 0.7, 1.3, 2.2, 3.5, 5.5, 8.0)]
    if track.servo:  # whose rows are far apart, or close, compared with a delay on its bus
        samples = [*(delay for delay in samples if delay < LONG), *BUS]
    return [{"delay": delay} for delay in samples]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"delay": 0.5 * track.sample_time}


JOINT_FITS.register(
    "latency",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="the command changes too little",
        excited_by="{quantity} that changes at every sample (random steps)",
        confusable=frozenset({"compliance"}),
        instants=True,  # commands that are held, or get lost
    ),
)
