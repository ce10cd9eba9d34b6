"""How Coulomb friction is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    most = 2 * (track.holding if track.held else s.peak_torque)
    return [linear("value", 0.0, most, s.torque, 0.5 * track.nominal.coulomb_friction + 0.1 * s.torque)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": track.nominal.coulomb_friction + 0.02 * track.scales.torque}]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": row["coulomb_friction"] * 1.2 + 0.005 * track.scales.peak_torque}


JOINT_FITS.register(
    "coulomb_friction",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little motion",
        excited_by="slow motion in both directions",
        confusable=frozenset({"stribeck_friction"}),
    ),
)
