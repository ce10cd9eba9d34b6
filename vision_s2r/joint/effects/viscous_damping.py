"""Friction that grows with speed."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class ViscousDamping(JointEffect):
    """b of −b·θ̇, on the motor where play or a spring divides it from the load."""

    name = "viscous_damping"
    source = "dynamics"
    parameters = (Parameter("value", "N·m·s/rad", low=0.0, high=1e6, neutral=None, moderate=0.15),)


Response = tuple[float, float, float, float]


@compiled
def response(damping: float, inertia: float, time: float) -> Response:
    """(E, G, A, B) of an inertia under damping and a constant torque: the exact solution after `time`.

    velocity = E·velocity + G·torque, distance = A·velocity + B·torque.
    """
    x = damping * time / inertia
    if x < 0.03:  # series: the closed forms cancel
        first = 1 - x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5 * (1 - x / 6))))
        second = 0.5 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5 * (1 - x / 6))))
    else:
        first = -math.expm1(-x) / x
        second = (1 - first) / x
    step = time / inertia
    return 1 - x * first, step * first, time * first, time * step * second


@compiled
def time_to_stop(velocity: float, torque: float, damping: float, inertia: float) -> float:
    """When a motion under damping and a constant torque against it comes to rest."""
    x = -damping * velocity / torque
    shape = math.log1p(x) / x if x > 1e-6 else 1 - x / 2
    return -inertia * velocity / torque * shape
