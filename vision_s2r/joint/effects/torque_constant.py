"""A current makes more or less torque than believed."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class TorqueConstant(JointEffect):
    """K of the motor torque K·u. Degenerate with everything else scaled by its inverse."""

    name = "torque_constant"
    source = "dynamics"
    parameters = (Parameter("value", "N·m/A", low=1e-6, high=1e6, neutral=None, moderate=0.4, scale="log"),)


@compiled
def motor_torque(current: float, constant: float) -> float:
    """Torque of a current, before the drive's limits."""
    return constant * current
