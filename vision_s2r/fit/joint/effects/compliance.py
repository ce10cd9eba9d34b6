"""How a spring between motor and load is fitted."""

import math

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    inertia, slow, fast = track.nominal.inertia, 2 * math.pi * 0.3, 2 * math.pi * 0.4 / track.sample_time
    return [
        log("stiffness", inertia / 4 * slow**2, inertia / 4 * fast**2 * 4, 0.005),
        log("damping", 1e-3 * inertia * slow, 10 * inertia * fast, 0.02, 3.0),
    ]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    frequencies = [f for f in (2.5, 5, 9, 15, 25) if f < 0.35 / track.sample_time]
    springs = [row["inertia"] / 4 * (2 * math.pi * f) ** 2 for f in frequencies]
    return [
        {"stiffness": k, "damping": 2 * z * math.sqrt(k * row["inertia"] / 4)} for k in springs for z in (0.05, 0.3)
    ]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    frequency = min(10.0, 0.2 / track.sample_time)
    stiffness = row["inertia"] / 4 * (2 * math.pi * frequency) ** 2
    return {"stiffness": stiffness, "damping": 0.2 * math.sqrt(stiffness * row["inertia"] / 4)}


JOINT_FITS.register(
    "compliance",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="nothing excites a vibration",
        excited_by="a chirp up to {fast:.3g} Hz",
    ),
)
