"""A motor brakes itself while its drive is on."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class BackEmf(JointEffect):
    """− back_emf·θ̇ of the motor's torque while the drive is on: a voltage drives it, less what its motion induces.

    A drive that is off (`enabled` or `supply` is 0) leaves the windings open, and only b is left; where it is never off
    this is one with viscous damping, and what is believed of both tells them apart. It is K_t²/R at the joint, a data
    sheet's stall torque over its speed without load (Duclusaud, Passault, Padois and Ly 2024:
    "Extended friction models for the physics simulation of servo actuators").
    """

    name = "back_emf"
    source = "dynamics"
    parameters = (Parameter("value", "N·m·s/rad", low=0.0, high=1e6, neutral=None, moderate=0.2),)


@compiled
def back_emf(damping: float, factor: float, velocity: float) -> float:
    """Torque on a motor of this velocity, under a supply of this factor."""
    return -damping * velocity if factor > 0 else 0.0
