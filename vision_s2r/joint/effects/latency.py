"""The command arrives late: bus, driver, current loop."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class Latency(JointEffect):
    """The command acts `delay` later, any fraction of a sample.

    Before the first command there is none (0); a position servo stays at the first position.
    """

    name = "latency"
    source = "actuator"
    parameters = (Parameter("delay", "s", low=0.0, high=10.0, neutral=0.0, moderate=0.015),)


@compiled
def split_delay(delay: float, sample_time: float) -> tuple[int, float]:
    """Whole samples of a delay, and the seconds left: so long into a sample the command changes."""
    whole = math.floor(delay / sample_time)
    return int(whole), min(max(delay - whole * sample_time, 0.0), sample_time)
