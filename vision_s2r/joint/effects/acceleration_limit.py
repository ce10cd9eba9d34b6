"""A servo that speeds its set point up, and slows it down, no faster than it is told to."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect

PHASES = 6  # of one way: braking, speeding up, going on, slowing down, and what rounding leaves


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
def accelerated(
    place: float, rate: float, target: float, fastest: float, steepest: float, time: float
) -> tuple[float, float]:
    """Set point and its rate after `time`, exactly: phase by phase, each of constant acceleration."""
    for _ in range(PHASES):
        if time <= 0:
            break
        stopping = target - place - 0.5 * rate * abs(rate) / steepest  # what is left when braking begins now
        if abs(stopping) <= 1e-12 * (1 + abs(target)):
            if rate == 0:
                return target, 0.0
            span, change = abs(rate) / steepest, -steepest if rate > 0 else steepest
        else:
            side = 1.0 if stopping > 0 else -1.0
            ahead = side * rate  # the rate towards where the set point has to turn to
            if ahead > fastest:
                span, change = (ahead - fastest) / steepest, -side * steepest
            elif ahead == fastest:  # until braking has to begin
                span, change = side * stopping / fastest, 0.0
            else:
                # Speeding up changes what braking leaves: its root is where braking has to begin.
                way = side * (target - place)
                peak = math.sqrt(max(steepest * way + 0.5 * ahead * abs(ahead) * (1 if ahead > 0 else -1), 0.0))
                span, change = (min(peak, fastest) - ahead) / steepest, side * steepest
                if span <= 0:
                    span = time
        span = min(span, time)
        place += span * (rate + 0.5 * span * change)
        rate += span * change
        if abs(rate) > fastest * (1 - 1e-12) and abs(rate) < fastest * (1 + 1e-12):
            rate = fastest if rate > 0 else -fastest
        time -= span
    return place, rate
