"""A position servo pulls harder or softer than believed."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class ProportionalGain(JointEffect):
    """K_p of a servo's u = clip(K_p·(target − θ) − K_d·θ̇, ±limit), in units of u.

    Where u never reaches its limit it is degenerate with a torque constant, and with everything else scaled.
    """

    name = "proportional_gain"
    source = "dynamics"
    servo = True
    parameters = (Parameter("value", "1/rad", low=1e-6, high=1e9, neutral=None, moderate=12.0, scale="log"),)


@compiled
def servo_command(
    error: float, velocity: float, more: float, proportional: float, derivative: float, limit: float
) -> float:
    """What the law asks of the motor, in units of u, `more` being what is asked besides."""
    return min(max(proportional * error - derivative * velocity + more, -limit), limit)
