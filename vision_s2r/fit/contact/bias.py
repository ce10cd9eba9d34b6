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
    faces = _faces(recording.shape)
    for e in np.flatnonzero(rests.any(axis=1)) if len(faces) else ():
        angles, heights = _lying(faces, recording.position[e, rests[e]], recording.attitude[e, rests[e]])
        flat = angles < LEANS
        if flat.any():
            lean.append(float(np.median(angles[flat])))
            height.append(float(np.median(heights[flat])))
    if len(lean) < LEAST:
        return 0.0, 0.0
    turn = float(np.median(lean)) / MEDIAN
    level = ABSOLUTE * float(np.median(np.abs(np.array(height) - np.median(height))))
    return _beyond(level, noise[0]), _beyond(turn, noise[1])


def resting(shape: Shape, position: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """Height [N] (m) of the support under a body at rest: that of the face with which it lies there.

    Noise of the attitude lowers the lowest corner, whichever way it turns the body, and no face.
    """
    lowest, faces = shape.lowest(position, attitude), _faces(shape)
    if not len(faces):
        return lowest
    angle, height = _lying(faces, position, attitude)
    return np.where(angle < LEANS, height, lowest)


def _beyond(size: float, noise: float) -> float:
    return float(np.sqrt(size**2 - noise**2)) if size > CLEAR * noise else 0.0


def _faces(shape: Shape) -> np.ndarray:
    """Outward normals and offsets [F, 4] of a polyhedron's faces; none of a round body."""
    return ConvexHull(shape.points).equations if len(shape.points) else np.empty((0, 4))


def _lying(faces: np.ndarray, position: np.ndarray, attitude: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angle [N] (rad) between the vertical and the face nearest to the support; the height [N] (m) of that face."""
    down = Rotation.from_quat(attitude).inv().apply([0.0, 0.0, -1.0])
    cosines = down @ faces[:, :3].T
    angle = np.arccos(np.clip(cosines.max(axis=1), -1, 1))
    return angle, position[:, 2] + faces[cosines.argmax(axis=1), 3]
