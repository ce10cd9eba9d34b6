"""The weight of the load."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled, sine
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class GravityTorque(JointEffect):
    """τ_g of −τ_g·sin θ, θ = 0 hanging down, on the load."""

    name = "gravity_torque"
    source = "dynamics"
    parameters = (Parameter("value", "N·m", low=-1e6, high=1e6, neutral=None, moderate=0.1),)


@compiled
def gravity(position: float, torque: float) -> float:
    """Torque on the load."""
    return -torque * sine(position) if torque != 0 else 0.0
