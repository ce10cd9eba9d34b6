"""The effects of an arm: those of its joints, each of one joint, and those of the whole."""

import math

import numpy as np

from vision_s2r.effects import Effect, Parameter, Registry
from vision_s2r.joint import JOINT_EFFECTS

PAYLOAD, BASE_TILT, OFFSET = "payload", "base_tilt", "position_offset"
WHOLE: Registry[Effect] = Registry("arm")  # of no single joint


@WHOLE.register
class Payload(Effect):
    """A point mass on the last body, in its frame."""

    name = PAYLOAD
    source = "dynamics"
    parameters = (
        Parameter("mass", "kg", low=0.0, high=1e4, neutral=0.0, moderate=0.2),
        Parameter("x", "m", low=-10.0, high=10.0, neutral=None, moderate=0.0),
        Parameter("y", "m", low=-10.0, high=10.0, neutral=None, moderate=0.0),
        Parameter("z", "m", low=-10.0, high=10.0, neutral=None, moderate=0.0),
    )


@WHOLE.register
class BaseTilt(Effect):
    """The base is not level: in its frame gravity is R⊤·g, R = R_y(pitch)·R_x(roll)."""

    name = BASE_TILT
    source = "dynamics"
    parameters = tuple(
        Parameter(angle, "rad", low=-1.5, high=1.5, neutral=0.0, moderate=0.05) for angle in ("roll", "pitch")
    )


def tilted(gravity: np.ndarray, roll: float, pitch: float) -> np.ndarray:
    """A vector [3] of the world, as the gravity of a model is, in the frame of a base that is not level."""
    (cr, sr), (cp, sp) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch))
    turn = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]]) @ [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]]
    return np.asarray(turn.T @ gravity)


def of_bodies(name: str) -> bool:
    """Whether an effect of an arm changes its bodies, as all see them, rather than one joint's drive."""
    return name in WHOLE or name.endswith(f".{OFFSET}")


ARM_EFFECTS = WHOLE | JOINT_EFFECTS
