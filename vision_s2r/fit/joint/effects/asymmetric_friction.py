"""How friction that differs by direction is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    return [
        linear("viscous", -5 * s.damping, 5 * s.damping, s.damping),
        linear("coulomb", -s.peak_torque, s.peak_torque, s.torque),
    ]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    s = track.scales
    return [
        {"viscous": 0.1 * row["viscous_damping"] + 1e-3 * s.torque / s.speed, "coulomb": 0.0},
        {"viscous": 0.0, "coulomb": 0.02 * s.torque},
    ]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"viscous": 0.1 * row["viscous_damping"], "coulomb": 0.1 * row["coulomb_friction"]}


JOINT_FITS.register(
    "asymmetric_friction",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little motion in both directions",
        excited_by="the same motion in both directions, at several speeds",
        along=("velocity", "direction"),
    ),
)
