"""A servo that answers to how fast its error changes: a target that moves pulls it along."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class DerivativeOnError(JointEffect):
    """Adds gain·d(target − θ)/dt, low-passed by a time constant, to a servo's u, before its limit.

    The derivative term of a PID with a filter, on the error (Åström and Hägglund, Advanced PID Control, 2006, chapter
    3). It brakes as derivative_gain does, which is on θ̇ alone, but a target in motion takes the brake off, and one that
    jumps kicks, as hard as the limit lets it. The target counts as having stood still before an episode.
    """

    name = "derivative_on_error"
    source = "actuator"
    servo = True
    parameters = (
        Parameter("gain", "s/rad", low=0.0, high=1e6, neutral=0.0, moderate=0.3),
        Parameter("time_constant", "s", low=1e-4, high=1.0, neutral=None, moderate=0.01, scale="log"),
    )


@compiled
def passing(time_constant: float, step: float) -> float:
    """The share of a change that has passed the filter after a step."""
    return 1 - math.exp(-step / time_constant)
