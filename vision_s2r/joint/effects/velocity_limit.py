"""A servo that moves its set point no faster than it is told to."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect
from vision_s2r.joint.effects.acceleration_limit import accelerated


@JOINT_EFFECTS.register
class VelocityLimit(JointEffect):
    """The set point goes to the target at `value` at most; an episode begins with it at the first position."""

    name = "velocity_limit"
    source = "actuator"
    servo = True
    parameters = (Parameter("value", "rad/s", low=1e-6, high=1e6, neutral=math.inf, moderate=2.0, scale="log"),)


@compiled
def profile(
    place: float, rate: float, target: float, fastest: float, steepest: float, time: float
) -> tuple[float, float]:
    """Set point and its rate after `time` on the quickest way to rest at the target within both limits."""
    if steepest < math.inf:
        return accelerated(place, rate, target, fastest, steepest, time)
    way = target - place
    if abs(way) <= fastest * time:
        return target, 0.0
    rate = fastest if way > 0 else -fastest
    return place + rate * time, rate
