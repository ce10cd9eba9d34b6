"""Where to hold a printed target before a camera, so that its rivals differ most."""

import itertools
from collections.abc import Mapping

import cv2
import numpy as np

POSES = 16  # that are asked for
COLUMNS = ("x", "y", "z", "pitch", "yaw", "roll")
PAPER = 0.5  # coded value of what is around the print


def candidates(filling: float) -> np.ndarray:
    """Poses [N, 6] of a print before the camera, as COLUMNS; the first POSES are a spread of them.

    x, y, z are where its middle is, in widths of the print and OpenCV's axes (right, down, away), and (pitch, yaw,
    roll) is its rotation vector (rad), 0 facing the camera. `filling`: the distance at which it fills the picture.
    """
    places, tilts = (0.0, -0.3, 0.3), ((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.4))
    shifts = [(x, y) for y, x in itertools.product(places, places)]
    straight = [(*shift, 1.0, *tilts[0]) for shift in shifts]
    tilted = [(0.0, 0.0, 1.0, *tilt) for tilt in tilts[1:]]
    first = straight + tilted + [(x, 0.0, 1.5, *tilts[0]) for x in places]
    others = [(*shift, far, *tilt) for far in (1.0, 1.5) for tilt in tilts for shift in shifts]
    poses = np.array(list(dict.fromkeys(first + others)))
    return poses * (1, 1, filling, 1, 1, 1)


def seen(target: np.ndarray, pose: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """What an ideal camera of `intrinsics` (fx, fy, cx, cy) sees of a print [H, W] in a pose [6]: coded [H, W]."""
    height, width = target.shape
    turn = cv2.Rodrigues(pose[3:].astype(float))[0]
    plane = np.column_stack([turn[:, 0], turn[:, 1], pose[:3]])  # from the print's plane, in its widths
    fx, fy, cx, cy = intrinsics
    camera = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    across, down = 0.5 / width - 0.5, (0.5 - height / 2) / width
    place = np.array([[1 / width, 0.0, across], [0.0, 1 / width, down], [0.0, 0.0, 1.0]])  # of the print's pixels
    whole = camera @ plane @ place
    return cv2.warpPerspective(target, whole, (width, height), flags=cv2.INTER_LINEAR, borderValue=PAPER)


def table(poses: np.ndarray) -> Mapping[str, np.ndarray]:
    """Poses [N, 6] as the columns of a table, a photograph a row."""
    return {"photograph": np.arange(1, len(poses) + 1), **dict(zip(COLUMNS, poses.T, strict=True))}
