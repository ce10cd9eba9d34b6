"""The drive's current limit."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class TorqueSaturation(JointEffect):
    """Motor torque K·u clipped to ±limit."""

    name = "torque_saturation"
    source = "actuator"
    parameters = (Parameter("limit", "N·m", low=1e-9, high=1e6, neutral=math.inf, moderate=0.5, scale="log"),)


@compiled
def saturate(torque: float, limit: float) -> float:
    """The torque that the drive gives."""
    return min(max(torque, -limit), limit)
