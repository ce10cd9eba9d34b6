"""How viscous damping is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    nominal = track.nominal.viscous_damping
    return [linear("value", 0.0, 20 * (s.damping + nominal), s.damping, 0.5 * nominal or 0.1 * s.damping)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": track.nominal.viscous_damping + 0.1 * track.scales.torque / track.scales.speed}]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    s = track.scales
    return {"value": row["viscous_damping"] + 0.1 * s.peak_torque / max(s.top_speed(row), 1e-12)}


JOINT_FITS.register(
    "viscous_damping",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little speed",
        excited_by="motion at high speed",
        confusable=frozenset({"thermal_drift", "torque_speed_limit"}),
        along=("velocity",),
    ),
)
