"""Grease thins as it warms."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class ThermalDrift(JointEffect):
    """Viscous damping b·(1 + rate·t), t from the start of the episode; in each direction where it is asymmetric."""

    name = "thermal_drift"
    source = "actuator"
    parameters = (Parameter("rate", "1/s", low=-10.0, high=10.0, neutral=0.0, moderate=0.05),)


@compiled
def drifted(damping: float, rate: float, time: float) -> float:
    """The damping at this time; never less than 0."""
    return max(damping * (1 + rate * time), 0.0)
