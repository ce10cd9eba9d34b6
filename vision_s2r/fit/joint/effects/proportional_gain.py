"""How a servo's proportional gain is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    nominal = track.nominal.proportional_gain or 1.0
    return [log("value", nominal / 10, nominal * 10, prior=0.7)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": row["proportional_gain"] * x} for x in (0.8, 1.0, 1.25)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": 1.1 * row["proportional_gain"]}


JOINT_FITS.register(
    "proportional_gain",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little motion, or torque at its limit",
        excited_by="a load that is known, held at rest",
        confusable=frozenset(
            {"inertia", "viscous_damping", "coulomb_friction", "gravity_torque", "load_dependent_friction"}
        ),
    ),
)
