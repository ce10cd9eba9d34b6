"""Gears that a load presses rub harder, whatever the motor does."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class ExternalLoadFriction(JointEffect):
    """Adds coefficient·|torque on the load| to the dry friction: of its weight, of what pulls at it.

    Beside friction under the motor's torque the two oppose each other in the gears: |c_m·τ_m − c_l·τ_l|. (Duclusaud,
    Passault, Padois and Ly, "Extended Friction Models for the Physics Simulation of Servo Actuators", 2024: the
    directional load-dependent part of their model M5.)
    """

    name = "external_load_friction"
    source = "actuator"
    parameters = (Parameter("coefficient", "", low=0.0, high=0.95, neutral=0.0, moderate=0.15),)
