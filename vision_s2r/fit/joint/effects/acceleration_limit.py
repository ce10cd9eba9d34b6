"""How the acceleration of a servo's set point is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    size = track.scales.peak_speed**2 / track.scales.span
    return [log("value", 0.05 * size, 500 * size, 0.01)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    size = track.scales.peak_speed**2 / track.scales.span
    return [{"value": x * size} for x in (0.3, 1.0, 4.0, 15.0, 60.0)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": 10 * track.scales.peak_speed**2 / track.scales.span}


JOINT_FITS.register(
    "acceleration_limit",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="no target jumps far enough",
        excited_by="a target that jumps over the whole range",
        confusable=frozenset({"latency"}),
    ),
)
