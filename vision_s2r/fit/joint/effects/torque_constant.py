"""How a torque constant is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    nominal = track.nominal.torque_constant
    return [log("value", nominal / 10, nominal * 10, prior=0.7)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": track.nominal.torque_constant * x} for x in (0.9, 1.0, 1.1)]


JOINT_FITS.register(
    "torque_constant",
    JointFit(
        ranges=ranges,
        starts=starts,
        confusable=frozenset(
            {"inertia", "viscous_damping", "coulomb_friction", "gravity_torque", "load_dependent_friction"}
        ),
    ),
)
