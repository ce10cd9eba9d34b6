"""What a joint effect is: a wrong nominal parameter, or something of the drive that the simulator lacks."""

from typing import Any, ClassVar

from vision_s2r.effects import Effect, Parameter, Registry

# What the units of a rotary joint are called where the joint is linear.
LINEAR_UNITS = {
    "rad": "m",
    "rad/s": "m/s",
    "N·m": "N",
    "N·m/A": "N/A",
    "kg·m²": "kg",
    "N·m·s/rad": "N·s/m",
    "N·m/rad": "N/m",
    "rad/s²": "m/s²",
    "1/rad": "1/m",
    "s/rad": "s/m",
}


class JointEffect(Effect):
    """An effect of a joint's drive.

    To add one: a class in a file of `vision_s2r/joint/effects`, decorated with `JOINT_EFFECTS.register`, its
    formula compiled beside it. A torque on the motor is all said with `motor_torque`; what acts elsewhere has its place
    in `joint/drive.py` or in the integrators.

    Bounds are wide enough for a wristwatch and for an axis of a milling machine, in SI units; `moderate` is meant for
    a small joint (0.02 kg·m², 0.1 N·m·s/rad, 0.02 N·m, about 1 N·m of motor torque).
    """

    # A torque (N·m) on the motor, as a static method that is compiled (`joint.compiled.compiled`): of the motor's
    # position and velocity, of time since the episode's start, and of the parameters in their order.
    motor_torque: ClassVar[Any] = None
    of_velocity: ClassVar[bool] = False  # whether that torque depends on velocity
    servo: ClassVar[bool] = False  # of the law of a position servo, and of no other joint


JOINT_EFFECTS: Registry[JointEffect] = Registry("joint")


def unit(parameter: Parameter, units: str) -> str:
    """The parameter's unit in a recording whose `units` are "rotary" or "linear"."""
    return LINEAR_UNITS.get(parameter.unit, parameter.unit) if units == "linear" else parameter.unit
