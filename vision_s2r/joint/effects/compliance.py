"""A gear, belt or shaft that gives."""

import math

import numpy as np

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class Compliance(JointEffect):
    """A spring of `stiffness` and `damping` between motor and load.

    Inertia is split in half; friction acts on the motor, gravity and bias on the load, which the encoder sees. An
    episode starts with the spring at rest.
    """

    name = "compliance"
    source = "actuator"
    parameters = (
        Parameter("stiffness", "N·m/rad", low=1e-6, high=1e9, neutral=math.inf, moderate=5.0, scale="log"),
        Parameter("damping", "N·m·s/rad", low=0.0, high=1e6, neutral=None, moderate=0.01),
    )


@compiled
def spring_response(
    stiffness: float, damping: float, motor_damping: float, inertia: float, time: float, out: np.ndarray
) -> None:
    """What constant torques make of two inertias (of `inertia` each) and a spring after `time`: exact, into `out`.

    out [4, 5]: rows motor velocity, load velocity, twist (motor - load), distance of the load; columns motor
    velocity, load velocity, twist, motor torque, load torque before. The matrix exponential by scaling and squaring.
    """
    rate = np.zeros((6, 6))  # of motor velocity, load velocity, twist, load position, the two torques
    rate[0, 0], rate[0, 1], rate[0, 2], rate[0, 4] = -motor_damping - damping, damping, -stiffness, 1.0
    rate[1, 0], rate[1, 1], rate[1, 2], rate[1, 5] = damping, -damping, stiffness, 1.0
    rate[:2] /= inertia
    rate[2, 0], rate[2, 1], rate[3, 1] = 1.0, -1.0, 1.0
    norm = time * np.abs(rate).sum(axis=1).max()
    halvings = max(0, math.ceil(math.log2(max(norm, 1e-300))) + 3)
    scaled = rate * (time / 2.0**halvings)
    total, term = np.eye(6), np.eye(6)
    for k in range(1, 10):  # norm ≤ 1/8: the tenth term is below the last bit
        term = _product(term, scaled) / k
        total += term
    for _ in range(halvings):
        total = _product(total, total)
    for row in range(4):
        for column in range(3):
            out[row, column] = total[row, column]
        out[row, 3], out[row, 4] = total[row, 4], total[row, 5]


@compiled
def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of 6 x 6 matrices, in plain loops: a BLAS call costs more."""
    out = np.zeros((6, 6))
    for i in range(6):
        for k in range(6):
            for j in range(6):
                out[i, j] += a[i, k] * b[k, j]
    return out


@compiled
def spring_torque(twist: float, twist_rate: float, stiffness: float, damping: float) -> float:
    """Torque of the spring on the load."""
    return stiffness * twist + damping * twist_rate
