"""The motor's back-EMF: the faster it runs, the less it can push."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class TorqueSpeedLimit(JointEffect):
    """Motor torque K·u is at most stall·(1 − θ̇/no_load_speed) in the direction of motion, and stall against it.

    In the direction of motion it is never less than 0. θ̇ is the motor's.
    """

    name = "torque_speed_limit"
    source = "actuator"
    parameters = (
        Parameter("stall", "N·m", low=1e-9, high=1e6, neutral=math.inf, moderate=0.7, scale="log"),
        Parameter("no_load_speed", "rad/s", low=1e-6, high=1e6, neutral=math.inf, moderate=10.0, scale="log"),
    )


@compiled
def limit_by_speed(torque: float, velocity: float, stall: float, no_load_speed: float) -> float:
    """The torque that the motor gives at this velocity."""
    ahead = max(stall * (1 - abs(velocity) / no_load_speed), 0.0)
    if velocity >= 0:
        return min(max(torque, -stall), ahead)
    return min(max(torque, -ahead), stall)
