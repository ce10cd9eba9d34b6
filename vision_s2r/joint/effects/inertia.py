"""Motor, gear and load are heavier or lighter than believed."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class Inertia(JointEffect):
    """J of J·θ̈; half of it on each side where play or a spring divides motor and load."""

    name = "inertia"
    source = "dynamics"
    parameters = (Parameter("value", "kg·m²", low=1e-9, high=1e6, neutral=None, moderate=0.03, scale="log"),)


@compiled
def half(inertia: float) -> float:
    """The part of the motor, and that of the load."""
    return 0.5 * inertia
