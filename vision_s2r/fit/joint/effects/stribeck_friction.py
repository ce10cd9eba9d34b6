"""How static friction is fitted: from the Coulomb friction up."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    return [
        linear("static", 0.0, 2 * s.peak_torque, s.torque, above="coulomb_friction"),
        log("velocity", 2e-3 * s.peak_speed, 1.5 * s.peak_speed, 0.02),
    ]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    s = track.scales
    return [
        {"static": row["coulomb_friction"] + more * s.torque, "velocity": v * s.peak_speed}
        for more in (0.04, 0.15)
        for v in (0.01, 0.03, 0.1, 0.25)
    ]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    s = track.scales
    return {
        "static": row["coulomb_friction"] * 1.5 + 0.01 * s.torque,
        "velocity": max(0.05 * s.top_speed(row), 0.02 * s.peak_speed),
    }


JOINT_FITS.register(
    "stribeck_friction",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little slow motion",
        excited_by="slow reversals (a sine of {slow:.2g} Hz that barely moves the joint)",
        confusable=frozenset({"load_dependent_friction"}),
        along=("velocity",),
    ),
)
