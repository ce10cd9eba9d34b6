"""How an encoder's zero is fitted: it is seen through gravity."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    return [linear("value", -np.pi, np.pi, 1.0, 1.0)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start: at first order a weight's offset is a constant torque, which was refitted in its place."""
    weight, constant = row["gravity_torque"], row["bias_torque"] - track.nominal.bias_torque
    likely = float(np.arcsin(np.clip(-constant / weight, -1.0, 1.0))) if weight else 0.0
    return [{"value": row["position_offset"] + x} for x in (likely, -1.2, -0.3, 0.3, 1.2)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": row["position_offset"] + 0.1}


JOINT_FITS.register(
    "position_offset",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little is seen of the load's weight",
        excited_by="motion over the whole range of positions",
        confusable=frozenset({"bias_torque"}),
    ),
)
