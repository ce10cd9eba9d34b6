"""How a limit of the motor torque is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    peak = track.scales.peak_torque
    return [log("limit", 0.02 * peak, 1.02 * peak, 0.005)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"limit": x * track.scales.peak_torque} for x in (0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 0.97)]


def plausible(track: JointTrack, row: Row) -> Setting | None:
    """A size that an engineer would care about."""
    peak = track.scales.peak_torque
    held = row["coulomb_friction"] + abs(row["gravity_torque"]) + abs(row["bias_torque"])
    limit = max(0.7 * peak, 2.5 * held)  # a drive that can barely move its own friction is none
    return {"limit": limit} if limit < 0.98 * peak else None


JOINT_FITS.register(
    "torque_saturation",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="the torque never comes near a plausible limit",
        excited_by="{quantity} in steps of ±{peak:.3g} {unit} or more",
        confusable=frozenset({"torque_speed_limit", "proportional_gain"}),
        along=("torque",),
    ),
)
