"""How damping that drifts is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    duration = track.scales.duration
    return [linear("rate", -1 / duration, 10 / duration, 1 / duration)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"rate": x / track.scales.duration} for x in (-0.3, -0.03, 0.03, 0.4, 1.5)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    duration = track.scales.duration
    return {"rate": 0.05 if duration * 0.05 < 1 else 0.5 / duration}


JOINT_FITS.register(
    "thermal_drift",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="the episodes are too short, or too slow",
        excited_by="an episode of minutes at high speed",
        along=("time",),
    ),
)
