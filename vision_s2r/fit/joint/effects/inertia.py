"""How an inertia is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    nominal = track.nominal.inertia
    return [log("value", max(nominal / 20, track.least_inertia), nominal * 20, prior=0.4)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{"value": track.nominal.inertia * x} for x in (0.9, 1.1)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"value": row["inertia"] * 1.1}


JOINT_FITS.register(
    "inertia",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little acceleration",
        excited_by="fast reversals",
    ),
)
