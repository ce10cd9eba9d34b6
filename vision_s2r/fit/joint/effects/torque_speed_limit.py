"""How a torque that falls with speed is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    s = track.scales
    return [
        log("stall", 0.1 * s.peak_torque, 30 * s.peak_torque, 0.005),
        log("no_load_speed", 0.2 * s.peak_speed, 30 * s.peak_speed, 0.005),
    ]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    s = track.scales
    return [
        {"stall": x * s.peak_torque, "no_load_speed": v * s.peak_speed}
        for x in (0.6, 0.9, 1.3, 2.0)
        for v in (1.02, 1.3, 1.8, 3.0)
    ]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    s = track.scales
    return {"stall": 1.2 * s.peak_torque, "no_load_speed": max(1.5 * s.top_speed(row), 1.1 * s.peak_speed)}


JOINT_FITS.register(
    "torque_speed_limit",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="the speed is never high under torque",
        excited_by="full {effort} in one direction until the speed stops rising",
        along=("torque", "velocity"),
    ),
)
