"""Dry friction: constant against motion, and whatever holds the joint at rest."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class CoulombFriction(JointEffect):
    """τ_f of −τ_f·sign(θ̇), on the motor where play or a spring divides it from the load.

    At rest it takes any value up to τ_f that keeps the joint at rest.
    """

    name = "coulomb_friction"
    source = "dynamics"
    parameters = (Parameter("value", "N·m", low=0.0, high=1e6, neutral=None, moderate=0.04),)


@compiled
def direction_of(velocity: float, torque: float) -> float:
    """±1: of the motion, at rest of the torque that may start it."""
    sense = velocity if velocity != 0 else torque
    return 1.0 if sense >= 0 else -1.0
