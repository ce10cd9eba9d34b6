"""A servo that moves its set point no faster than it is told to."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect
from vision_s2r.joint.effects.acceleration_limit import Way, accelerated


@JOINT_EFFECTS.register
class VelocityLimit(JointEffect):
    """The set point goes to the target at `value` at most; an episode begins with it at the first position."""

    name = "velocity_limit"
    source = "actuator"
    servo = True
    parameters = (Parameter("value", "rad/s", low=1e-6, high=1e6, neutral=math.inf, moderate=2.0, scale="log"),)


@compiled
def profile(place: float, rate: float, target: float, fastest: float, steepest: float) -> Way:
    """The quickest way of a set point to rest at the target within both limits."""
    if steepest < math.inf:
        return accelerated(place, rate, target, fastest, steepest)
    way = target - place
    return place, fastest if way > 0 else -fastest, target, 0.0, abs(way) / fastest, 0.0, 0.0
