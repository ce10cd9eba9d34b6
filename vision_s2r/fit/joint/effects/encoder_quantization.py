"""An encoder's steps: their resolution is the grid's, nothing of it is fitted."""

import numpy as np

from vision_s2r.fit.coordinates import ParameterRange, Setting
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import JointTrack


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves."""
    return []


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Where it may start."""
    return [{}]


JOINT_FITS.register(
    "encoder_quantization",
    JointFit(
        ranges=ranges,
        starts=starts,
        excited_by="very slow motion",
    ),
)
