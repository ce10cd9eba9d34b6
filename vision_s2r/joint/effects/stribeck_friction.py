"""Dry friction is larger at rest than in motion."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class StribeckFriction(JointEffect):
    """Dry friction τ_f + (static − τ_f)·exp(−(θ̇/velocity)²), `static` holding at rest.

    τ_f is that of the direction where friction is asymmetric. The effect vanishes at static = τ_f, which is no
    number of its own: it has no neutral value. (Armstrong-Hélouvry et al., Automatica 30, 1994, with exponent 2.)
    """

    name = "stribeck_friction"
    source = "actuator"
    parameters = (
        Parameter("static", "N·m", low=0.0, high=1e6, neutral=None, moderate=0.08),
        Parameter("velocity", "rad/s", low=1e-6, high=1e3, neutral=None, moderate=0.2, scale="log"),
    )


@compiled
def stribeck_weight(velocity: float, scale: float) -> float:
    """How much of the static friction is felt at this velocity: 1 at rest, 0 far from it."""
    ratio = velocity / scale
    return math.exp(-ratio * ratio)


@compiled
def stribeck(sliding: float, static: float, weight: float) -> float:
    """Dry friction at a velocity of this weight; `sliding` is that of fast motion."""
    return sliding + (static - sliding) * weight
