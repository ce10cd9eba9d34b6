"""Real tosses of a cube as a recording: the data set of ContactNets.

S. Pfrommer, M. Halm, M. Posa, "ContactNets: Learning Discontinuous Contact Dynamics with Smooth, Implicit
Representations", CoRL 2020. Lengths are in units of the cube's half width, spins in the body's frame.
"""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.contact.shape import box
from vision_s2r.errors import UserError
from vision_s2r.recording.data import ContactRecording

HALF_WIDTH = 0.0524  # m
RATE = 148.0  # Hz
MASS = 0.37  # kg


def read_contactnets(path: Path | str, lateral_friction: float, restitution: float) -> ContactRecording:
    """All tosses of cube_tosses.npz, beside a simulator of these coefficients.

    `data` [N, 13] is position, quaternion w x y z, velocity and spin, `lengths` the samples of each toss. Velocities
    are left out: they are differences of positions, half a sample late. Raises UserError for no such file.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            data, lengths = np.asarray(content["data"], dtype=np.float64), content["lengths"].astype(np.int64)
    except (OSError, ValueError, KeyError) as error:
        raise UserError(f"{path}: cannot be read ({error}), expected data and lengths of tosses") from error
    if data.ndim != 2 or data.shape[1] != 13 or lengths.sum() != len(data):
        raise UserError(f"{path}: data {data.shape} and lengths that sum to {lengths.sum()}, expected [N, 13] and N")
    ends = np.cumsum(lengths)
    position = np.full((len(lengths), lengths.max(), 3), np.nan)
    attitude = np.full((len(lengths), lengths.max(), 4), np.nan)
    for k, (end, length) in enumerate(zip(ends, lengths, strict=True)):
        rows = data[end - length : end]
        position[k, :length] = HALF_WIDTH * rows[:, :3]
        attitude[k, :length] = Rotation.from_quat(rows[:, [4, 5, 6, 3]]).as_quat()
    return ContactRecording(
        nominal={"mass": MASS, "lateral_friction": lateral_friction, "restitution": restitution, "gravity": 9.81},
        shape=box((HALF_WIDTH,) * 3),
        sample_time=1 / RATE,
        position=position,
        attitude=attitude,
        velocity=None,
        lengths=lengths,
        episodes=tuple(range(len(lengths))),
    )
