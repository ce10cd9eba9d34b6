"""Gears that are pressed harder rub harder."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class LoadDependentFriction(JointEffect):
    """Adds coefficient·|motor torque| to the dry friction; the torque after the drive's limits, without cogging."""

    name = "load_dependent_friction"
    source = "actuator"
    parameters = (Parameter("coefficient", "", low=0.0, high=0.95, neutral=0.0, moderate=0.15),)


@compiled
def load_friction(motor: float, load: float) -> float:
    """Dry friction of gears between shares of the motor's torque and of the torque on the load."""
    return abs(motor - load)
