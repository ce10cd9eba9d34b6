"""A servo that speeds its set point up, and slows it down, no faster than it is told to."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect

# Where a set point is, its rate there, its target, its acceleration, and how long it speeds up (or slows down to turn),
# goes on at one rate, and slows down.
Way = tuple[float, float, float, float, float, float, float]


@JOINT_EFFECTS.register
class AccelerationLimit(JointEffect):
    """The set point's rate changes by `value` at most; it comes to rest at the target, as a trapezoidal profile does.

    An episode begins with it at rest at the first position.
    """

    name = "acceleration_limit"
    source = "actuator"
    servo = True
    parameters = (Parameter("value", "rad/s²", low=1e-6, high=1e9, neutral=math.inf, moderate=15.0, scale="log"),)


@compiled
def accelerated(place: float, rate: float, target: float, fastest: float, steepest: float) -> Way:
    """The quickest way to rest at the target within both limits, none of which the rate is beyond: a trapezoid."""
    stopping = target - place - 0.5 * rate * abs(rate) / steepest  # what is left when braking begins now
    side = 1.0 if stopping > 0 else -1.0
    ahead, way = side * rate, side * (target - place)
    square = steepest * way + 0.5 * ahead * ahead  # of the rate at which braking has to begin
    peak = min(math.sqrt(max(square, 0.0)), fastest)
    going = max(square - peak * peak, 0.0) / (steepest * peak) if peak > 0 else 0.0
    return place, rate, target, side * steepest, max(peak - ahead, 0.0) / steepest, going, peak / steepest


@compiled
def along(way: Way, time: float) -> tuple[float, float]:
    """Set point and its rate after `time` on its way."""
    place, rate, target, change, up, going, down = way
    if time < up:
        return place + time * (rate + 0.5 * time * change), rate + time * change
    left = up + going + down - time
    if left <= 0:
        return target, 0.0
    if left < down:
        return target - 0.5 * change * left * left, change * left
    return target - change * down * (left - 0.5 * down), change * down
