"""The motor's magnets pull towards the teeth of its iron."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled, sine
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@compiled
def cogging(position: float, velocity: float, time: float, amplitude: float, teeth: float) -> float:
    """Torque on the motor."""
    return amplitude * sine(teeth * position) if amplitude != 0 else 0.0


@JOINT_EFFECTS.register
class Cogging(JointEffect):
    """+ amplitude·sin(teeth·θ) on the motor, θ the motor's position where play or a spring divides it from the load."""

    name = "cogging"
    source = "actuator"
    parameters = (
        Parameter("amplitude", "N·m", low=0.0, high=1e6, neutral=0.0, moderate=0.08),
        Parameter("teeth", "", low=0.5, high=1e5, neutral=None, moderate=12.0, scale="log"),
    )
    motor_torque = staticmethod(cogging)
