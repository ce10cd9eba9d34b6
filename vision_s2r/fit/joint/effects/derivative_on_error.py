"""How a servo's derivative on its error is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack

TIMES = (0.003, 0.01, 0.03)  # s, of filters


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    damping = track.scales.damping / track.nominal.torque_constant
    return [linear("gain", 0.0, 20 * damping, damping), log("time_constant", 1e-3, 0.2, 0.02)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    braking = row["viscous_damping"] / row["torque_constant"]
    sizes = 0.3 * max(braking, track.scales.damping / row["torque_constant"]), 0.1 * braking
    return [{"gain": gain, "time_constant": time} for gain in sizes for time in TIMES]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"gain": 0.1 * track.scales.damping / row["torque_constant"], "time_constant": TIMES[1]}


JOINT_FITS.register(
    "derivative_on_error",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="targets move too little",
        excited_by="targets that move fast, and targets that jump",
        confusable=frozenset({"viscous_damping", "derivative_gain", "velocity_limit", "acceleration_limit", "latency"}),
    ),
)
