"""Friction differs between the directions: a worn screw, a preloaded gear."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class AsymmetricFriction(JointEffect):
    """b ± viscous and τ_f ± coulomb for motion in the ± direction."""

    name = "asymmetric_friction"
    source = "actuator"
    parameters = (
        Parameter("viscous", "N·m·s/rad", low=-1e6, high=1e6, neutral=0.0, moderate=0.03),
        Parameter("coulomb", "N·m", low=-1e6, high=1e6, neutral=0.0, moderate=0.01),
    )


@compiled
def directed(value: float, difference: float, direction: float) -> float:
    """The friction of motion in this direction (±1); never less than 0."""
    return max(value + direction * difference, 0.0)
