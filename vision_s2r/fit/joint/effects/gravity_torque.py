"""How the weight of the load is fitted."""

import math
from dataclasses import replace

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack

WEIGHED = 0.05  # of a weight that a servo's simulator has, which was weighed; of other weights less is known


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s, weight = track.scales, abs(track.nominal.gravity_torque)
    # Where a servo's positions cover little of a turn, a weight is a slope, which anything else that is lacking bends.
    seen = min(1.0, s.span / math.pi) if track.servo and track.units == "rotary" else 1.0
    plain = linear("value", -3 * s.peak_torque, 3 * s.peak_torque, s.torque, 0.5 * s.torque * seen)
    return [replace(plain, firmer=WEIGHED * weight if track.servo and weight else math.inf)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": track.nominal.gravity_torque + 0.05 * track.scales.torque}]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": row["gravity_torque"] + 0.1 * track.scales.peak_torque}


JOINT_FITS.register(
    "gravity_torque",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little is seen of the position",
        excited_by="motion over the whole range of positions",
    ),
)
