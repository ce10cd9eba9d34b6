"""A constant load: a preloaded spring, a cable, an amplifier's offset."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class BiasTorque(JointEffect):
    """τ_0 of −τ_0, on the load."""

    name = "bias_torque"
    source = "dynamics"
    parameters = (Parameter("value", "N·m", low=-1e6, high=1e6, neutral=None, moderate=0.03),)


@compiled
def bias(torque: float) -> float:
    """Torque on the load."""
    return -torque
