"""How play is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    span = track.scales.span
    return [log("width", max(1e-5 * span, 0.5 * noise, 1e-7), max(span, 1e-6), 0.02)]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    span = track.scales.span
    return [{"width": float(w)} for w in np.geomspace(max(3e-4 * span, 1e-6), 0.4 * span, 14)]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    return {"width": 0.02 if track.units == "rotary" else 0.002 * track.scales.span}


JOINT_FITS.register(
    "backlash",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="no reversal under load that would have crossed the play",
        excited_by="reversals of direction, {rate:.2g} times a second or more",
        confusable=frozenset({"compliance", "latency"}),
        rough=True,
        rippled=True,
        along=("acceleration",),
    ),
)
