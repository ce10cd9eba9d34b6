"""How static friction that grows with the motor torque is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    return [linear("coefficient", 0.0, 0.95, 0.5), log("velocity", 2e-3 * s.peak_speed, 1.5 * s.peak_speed, 0.02)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    speeds = [v * track.scales.peak_speed for v in (0.01, 0.03, 0.1, 0.25)]
    return [{"coefficient": c, "velocity": v} for c in (0.05, 0.2) for v in speeds]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    s = track.scales
    return {"coefficient": 0.15, "velocity": max(0.05 * s.top_speed(row), 0.02 * s.peak_speed)}


JOINT_FITS.register(
    "load_dependent_stribeck",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little slow motion under load",
        excited_by="slow reversals under a load, and without it",
        confusable=frozenset({"stribeck_friction", "load_dependent_friction"}),
        along=("velocity",),
    ),
)
