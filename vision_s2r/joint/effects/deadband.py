"""A servo that leaves small errors alone."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class Deadband(JointEffect):
    """No torque while |target − θ| < width/2, and outside it K_p·(error ∓ width/2)."""

    name = "deadband"
    source = "actuator"
    servo = True
    parameters = (Parameter("width", "rad", low=0.0, high=3.0, neutral=0.0, moderate=0.04),)


@compiled
def beyond(error: float, width: float) -> float:
    """The error that counts."""
    half = 0.5 * width
    return error - half if error > half else error + half if error < -half else 0.0
