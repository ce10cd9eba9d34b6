"""How a constant load is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    return [linear("value", -s.peak_torque, s.peak_torque, s.torque, 0.25 * s.torque)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": track.nominal.bias_torque + 0.02 * track.scales.torque}]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": row["bias_torque"] + 0.03 * track.scales.peak_torque}


JOINT_FITS.register(
    "bias_torque",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="a constant torque would not have shown",
        excited_by="slow motion in both directions",
        confusable=frozenset({"asymmetric_friction"}),
    ),
)
