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
    rate[0, 0], rate[0, 1], rate[0, 2] = -(motor_damping + damping) / inertia, damping / inertia, -stiffness / inertia
    rate[1, 0], rate[1, 1], rate[1, 2] = damping / inertia, -damping / inertia, stiffness / inertia
    rate[0, 4] = rate[1, 5] = 1 / inertia
    rate[2, 0], rate[2, 1], rate[3, 1] = 1.0, -1.0, 1.0
    norm = time * (2 + (motor_damping + 2 * damping + stiffness + 1) / inertia)  # or more than it
    halvings = max(0, math.ceil(math.log2(norm)) + 3)
    scale = time / 2.0**halvings
    total, term, product = np.zeros((6, 6)), np.zeros((6, 6)), np.zeros((6, 6))
    for i in range(6):
        total[i, i] = term[i, i] = 1.0
    for k in range(1, 10):  # norm ≤ 1/8: the tenth term is below the last bit
        _multiply(term, rate, scale / k, product)
        term, product = product, term
        for i in range(6):
            for j in range(6):
                total[i, j] += term[i, j]
    for _ in range(halvings):
        _multiply(total, total, 1.0, product)
        total, product = product, total
    for row in range(4):
        for column in range(5):
            out[row, column] = total[row, column if column < 3 else column + 1]


@compiled
def _multiply(a: np.ndarray, b: np.ndarray, scale: float, out: np.ndarray) -> None:
    """scale·a·b of 6 x 6 matrices, in plain loops: a BLAS call costs more."""
    for i in range(6):
        for j in range(6):
            entry = 0.0
            for k in range(6):
                entry += a[i, k] * b[k, j]
            out[i, j] = scale * entry


@compiled
def spring_torque(twist: float, twist_rate: float, stiffness: float, damping: float) -> float:
    """Torque of the spring on the load."""
    return stiffness * twist + damping * twist_rate
