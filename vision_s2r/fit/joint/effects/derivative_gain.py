"""How a servo's derivative gain is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    damping = track.scales.damping / track.nominal.torque_constant
    return [linear("value", 0.0, 20 * damping + 5 * track.nominal.derivative_gain, damping, 3 * damping)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [plausible(track, row)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": row["derivative_gain"] + 0.1 * track.scales.damping / row["torque_constant"]}


JOINT_FITS.register(
    "derivative_gain",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little speed",
        excited_by="fast reversals",
        confusable=frozenset({"viscous_damping"}),
    ),
)
