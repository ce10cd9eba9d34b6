"""How friction that grows with the torque on the load is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    return [linear("coefficient", 0.0, 0.95, 0.5)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"coefficient": c} for c in (0.01, 0.05, 0.2)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"coefficient": 0.1}


JOINT_FITS.register(
    "external_load_friction",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        confusable=frozenset({"coulomb_friction", "load_dependent_friction"}),
        not_excited="no weight or pull on the load, or the same one throughout",
        excited_by="a heavy and a light load at like speed",
        along=("position",),
    ),
)
