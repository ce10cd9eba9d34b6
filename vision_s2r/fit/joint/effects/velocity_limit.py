"""How the speed of a servo's set point is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    return [log("value", 0.05 * track.scales.peak_speed, 20 * track.scales.peak_speed, 0.005)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": x * track.scales.peak_speed} for x in (0.4, 0.7, 0.9, 1.1, 1.6, 2.5)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": 1.2 * track.scales.peak_speed}


JOINT_FITS.register(
    "velocity_limit",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="no target is far enough away",
        excited_by="a target that jumps over the whole range",
        confusable=frozenset({"torque_speed_limit", "acceleration_limit"}),
    ),
)
