"""How a servo's deadband is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s, nominal = track.scales, track.nominal
    gain = nominal.torque_constant * (nominal.proportional_gain or 1.0)
    return [linear("width", 0.0, 4 * s.peak_torque / gain, s.torque / gain)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    gain = row["torque_constant"] * row["proportional_gain"]
    return [{"width": x * track.scales.torque / gain} for x in (0.05, 0.3, 1.0)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"width": 0.02 if track.units == "rotary" else 0.002 * track.scales.span}


JOINT_FITS.register(
    "deadband",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="the servo never has to settle",
        excited_by="targets that change by less than a degree at a time",
        confusable=frozenset({"backlash", "coulomb_friction"}),
    ),
)
