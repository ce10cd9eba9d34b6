"""How far measured poses are from those of a rigid body on a plane where both are known: at rest.

Noise differs from one sample to the next; this does not, within a toss: a marker that is not where it is believed to
be, a camera's calibration, a support that is not quite flat. A body at rest lies on its support with a face.
"""

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from vision_s2r.contact import Shape
from vision_s2r.recording import ContactRecording

LEAST = 3  # episodes that end at rest, to say anything
MEDIAN = 1.1774  # of the length of two normal numbers, in standard deviations
ABSOLUTE = 1.4826  # standard deviations a median absolute deviation
CLEAR = 1.5  # times the noise: what is less may be noise
LEANS = 0.1  # rad: a body that leans more does not lie on a face


def bias_of(recording: ContactRecording, rests: np.ndarray, noise: tuple[float, float]) -> tuple[float, float]:
    """Standard deviations (m, rad) of a pose's error beyond its noise, of each component; `rests` [E, T] says when.

    0 for a round body, and where fewer than three episodes have such samples.
    """
    lean: list[float] = []
    height: list[float] = []
    for e in np.flatnonzero(rests.any(axis=1)) if len(recording.shape.points) else ():
        samples = np.flatnonzero(rests[e])
        angle = _lean(ConvexHull(recording.shape.points).equations, recording.attitude[e, samples])[0]
        flat = angle < LEANS
        if flat.any():
            lean.append(float(np.median(angle[flat])))
            rows = e, samples[flat]
            height.append(
                float(np.median(resting(recording.shape, recording.position[rows], recording.attitude[rows])))
            )
    if len(lean) < LEAST:
        return 0.0, 0.0
    turn = float(np.median(lean)) / MEDIAN
    level = ABSOLUTE * float(np.median(np.abs(np.array(height) - np.median(height))))
    return _beyond(level, noise[0]), _beyond(turn, noise[1])


def resting(shape: Shape, position: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """Height [N] (m) of the support under a body at rest: that of the face with which it lies there.

    Noise of the attitude lowers the lowest corner, whichever way it turns the body, and no face.
    """
    lowest = shape.lowest(position, attitude)
    if not len(shape.points):
        return lowest
    equations = ConvexHull(shape.points).equations
    angle, face = _lean(equations, attitude)
    return np.where(angle < LEANS, position[:, 2] + equations[face, 3], lowest)


def _beyond(size: float, noise: float) -> float:
    return float(np.sqrt(size**2 - noise**2)) if size > CLEAR * noise else 0.0


def _lean(equations: np.ndarray, attitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle [N] (rad) between the vertical and the face [N] of a hull that is nearest to the support."""
    down = Rotation.from_quat(attitude).inv().apply([0.0, 0.0, -1.0])
    cosines = down @ equations[:, :3].T
    return np.arccos(np.clip(cosines.max(axis=1), -1, 1)), cosines.argmax(axis=1)
