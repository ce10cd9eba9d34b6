"""Gears that are pressed harder stick harder."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class LoadDependentStribeck(JointEffect):
    """Adds coefficient·|motor torque|·exp(−(θ̇/velocity)²) to the dry friction, all of it at rest.

    The formulas are those of Stribeck's and of load-dependent friction. (Duclusaud, Passault, Padois and Ly, "Extended
    Friction Models for the Physics Simulation of Servo Actuators", 2024: the load-dependent part of their model M4.)
    """

    name = "load_dependent_stribeck"
    source = "actuator"
    parameters = (
        Parameter("coefficient", "", low=0.0, high=0.95, neutral=0.0, moderate=0.2),
        Parameter("velocity", "rad/s", low=1e-6, high=1e3, neutral=None, moderate=0.3, scale="log"),
    )
