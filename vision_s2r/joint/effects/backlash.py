"""Play in the gear."""

import math

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class Backlash(JointEffect):
    """`width` of total play between motor and load, whose impacts are inelastic.

    Inertia is split in half; friction acts on the motor, gravity and bias on the load, which the encoder sees. An
    episode starts in the middle of the play. With a spring besides (compliance), the play ends at the spring.
    """

    name = "backlash"
    source = "actuator"
    parameters = (Parameter("width", "rad", low=1e-7, high=3.0, neutral=0.0, moderate=0.03, scale="log"),)


@compiled
def contact_force(acceleration: float, load_torque: float, inertia: float) -> float:
    """Torque by which the motor pushes the load (of this inertia) when they move as one."""
    return inertia * acceleration - load_torque


@compiled
def merged(motor_velocity: float, load_velocity: float) -> float:
    """Velocity of both after an inelastic impact of equal inertias."""
    return 0.5 * (motor_velocity + load_velocity)


@compiled
def impact_time(gap: float, closing: float, end_gap: float, time: float) -> float:
    """When, within `time`, a gap that closes at first at the rate `closing` and ends below 0 reaches 0.

    The gap is a parabola through what is known of it: exact but for the third order in time.
    """
    curve = (end_gap - gap + closing * time) / (time * time)
    root = math.sqrt(max(closing * closing - 4 * curve * gap, 0.0))
    # The first positive root of gap - closing·t + curve·t², in the form that does not cancel.
    found = 2 * gap / (closing + root) if closing > 0 else (closing - root) / (2 * curve)
    return min(max(found, 0.0), time) if found == found else time
