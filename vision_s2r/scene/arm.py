"""The arm: a SCARA (two parallel turning joints, a vertical lift, a wrist) with a parallel-jaw gripper.

Four joints place the gripper at any (x, y, z, yaw) above the bin in closed form, and its links are boxes: light to
simulate and to draw. The tool centre lies between the finger tips, at their lower end.
"""

from dataclasses import dataclass

import numpy as np

BASE = (0.0, 0.44)  # m, the column's place behind the bin
UPPER_ARM = 0.28
FOREARM = 0.28
ARM_HEIGHT = 0.34  # of both links' middle plane
FINGER_SIZE = (0.008, 0.018, 0.055)  # along the closing axis, across it, down
PALM_SIZE = (0.115, 0.028, 0.03)
MAX_OPENING = 0.042  # of each finger, from the middle to its inner face
LINK_SECTION = (0.06, 0.045)  # across, height
QUILL_SIZE = (0.026, 0.026, 0.34)
COLUMN_SIZE = (0.09, 0.09, ARM_HEIGHT - LINK_SECTION[1])
JOINTS = ("shoulder", "elbow", "lift", "wrist", "finger_left", "finger_right")
KINDS = {
    "column": "arm",
    "upper_arm": "arm",
    "forearm": "arm",
    "quill": "arm",
    "palm": "gripper",
    "finger_left": "gripper",
    "finger_right": "gripper",
}
SIZES = {
    "column": COLUMN_SIZE,
    "upper_arm": (UPPER_ARM + LINK_SECTION[0], *LINK_SECTION),
    "forearm": (FOREARM + LINK_SECTION[0], *LINK_SECTION),
    "quill": QUILL_SIZE,
    "palm": PALM_SIZE,
    "finger_left": FINGER_SIZE,
    "finger_right": FINGER_SIZE,
}


@dataclass(frozen=True)
class ArmPart:
    """Where a box of the arm is: its name in SIZES, its middle [3] in metres, its yaw."""

    name: str
    position: tuple[float, float, float]
    yaw: float


def inverse(x: float, y: float, z: float, yaw: float, opening: float = MAX_OPENING) -> tuple[float, ...]:
    """The joints that put the tool centre at (x, y, z) with the closing axis along yaw (rad)."""
    dx, dy = x - BASE[0], y - BASE[1]
    reach = np.hypot(dx, dy)
    cosine = (reach**2 - UPPER_ARM**2 - FOREARM**2) / (2 * UPPER_ARM * FOREARM)
    elbow = float(np.arccos(np.clip(cosine, -1, 1)))
    shoulder = float(np.arctan2(dy, dx) - np.arctan2(FOREARM * np.sin(elbow), UPPER_ARM + FOREARM * np.cos(elbow)))
    return (shoulder, elbow, float(z), float(yaw) - shoulder - elbow, float(opening), float(opening))


def tool(joints: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Forward kinematics: (x, y, z, yaw) of the tool centre."""
    shoulder, elbow, lift, wrist = joints[:4]
    x = BASE[0] + UPPER_ARM * np.cos(shoulder) + FOREARM * np.cos(shoulder + elbow)
    y = BASE[1] + UPPER_ARM * np.sin(shoulder) + FOREARM * np.sin(shoulder + elbow)
    return float(x), float(y), lift, shoulder + elbow + wrist


def parts(joints: tuple[float, ...]) -> list[ArmPart]:
    """Where each box of the arm is: what a picture of it shows."""
    shoulder, elbow = joints[:2]
    x, y, z, yaw = tool(joints)
    elbow_x, elbow_y = BASE[0] + UPPER_ARM * np.cos(shoulder), BASE[1] + UPPER_ARM * np.sin(shoulder)
    palm_z = z + FINGER_SIZE[2] + PALM_SIZE[2] / 2
    found = [
        ArmPart("column", (*BASE, COLUMN_SIZE[2] / 2), 0.0),
        ArmPart("upper_arm", (*_middle(BASE, (elbow_x, elbow_y)), ARM_HEIGHT), shoulder),
        ArmPart("forearm", (*_middle((elbow_x, elbow_y), (x, y)), ARM_HEIGHT - LINK_SECTION[1]), shoulder + elbow),
        ArmPart("quill", (x, y, palm_z + PALM_SIZE[2] / 2 + QUILL_SIZE[2] / 2), yaw),
        ArmPart("palm", (x, y, palm_z), yaw),
    ]
    for name, offset in (("finger_left", joints[4]), ("finger_right", -joints[5])):
        offset += np.copysign(FINGER_SIZE[0] / 2, offset)
        place = (x + offset * np.cos(yaw), y + offset * np.sin(yaw), z + FINGER_SIZE[2] / 2)
        found.append(ArmPart(name, place, yaw))
    return found


def _middle(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
    return (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
