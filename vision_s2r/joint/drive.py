"""The torques of a drive, and its dry friction: the effects' formulas put together.

Everything here is compiled, a machine being the `Machine` tuple and `tables` what `tables.py` says.
"""

import math

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effects.asymmetric_friction import directed
from vision_s2r.joint.effects.bias_torque import bias
from vision_s2r.joint.effects.cogging import cogging
from vision_s2r.joint.effects.coulomb_friction import direction_of
from vision_s2r.joint.effects.gravity_torque import gravity
from vision_s2r.joint.effects.load_dependent_friction import load_friction
from vision_s2r.joint.effects.stribeck_friction import stribeck, stribeck_weight
from vision_s2r.joint.effects.thermal_drift import drifted
from vision_s2r.joint.effects.torque_constant import motor_torque
from vision_s2r.joint.effects.torque_saturation import saturate
from vision_s2r.joint.effects.torque_speed_limit import limit_by_speed
from vision_s2r.joint.effects.viscous_damping import Response, response, time_to_stop
from vision_s2r.joint.machine import Machine
from vision_s2r.joint.tables import look_up

Glide = tuple[float, Response]  # of motion in one direction: its damping, and the response of a whole step


@compiled
def needs_velocity(machine: Machine, tables: np.ndarray) -> bool:
    """Whether any torque but viscous damping and Coulomb friction depends on velocity."""
    stribeck_on = not math.isnan(machine.stribeck_friction_static)
    return stribeck_on or machine.torque_speed_limit_no_load_speed < math.inf or tables[1, 2] > 0


@compiled
def steady(machine: Machine, heights: np.ndarray) -> bool:
    """Whether a command held makes one torque in one direction, apart from viscous damping."""
    fixed = math.isnan(machine.stribeck_friction_static) and machine.torque_speed_limit_stall == math.inf
    return fixed and machine.gravity_torque == 0 and machine.cogging_amplitude == 0 and len(heights) == 0


@compiled
def commanded(machine: Machine, current: float, velocity: float) -> float:
    """Motor torque of a command at a motor velocity."""
    torque = saturate(motor_torque(current, machine.torque_constant), machine.torque_saturation_limit)
    if machine.torque_speed_limit_stall < math.inf:
        torque = limit_by_speed(
            torque, velocity, machine.torque_speed_limit_stall, machine.torque_speed_limit_no_load_speed
        )
    return torque


@compiled
def on_motor(
    machine: Machine, tables: np.ndarray, heights: np.ndarray, position: float, velocity: float, time: float
) -> float:
    """Torque on the motor beside the commanded one and friction."""
    torque = cogging(position, machine.cogging_amplitude, machine.cogging_teeth)
    return torque + look_up(tables, heights, position, velocity, time)


@compiled
def on_load(machine: Machine, position: float) -> float:
    """Torque on the load."""
    return gravity(position, machine.gravity_torque) + bias(machine.bias_torque)


@compiled
def weight_at(machine: Machine, velocity: float) -> float:
    """How much of the static friction is felt: 1 at rest. 0 where friction does not know rest from motion."""
    if math.isnan(machine.stribeck_friction_static):
        return 0.0
    return stribeck_weight(velocity, machine.stribeck_friction_velocity)


@compiled
def dry(machine: Machine, direction: float, weight: float, motor: float) -> float:
    """Dry friction against motion in this direction (±1) under this motor torque."""
    friction = directed(machine.coulomb_friction, machine.asymmetric_friction_coulomb, direction)
    if not math.isnan(machine.stribeck_friction_static):
        friction = stribeck(friction, machine.stribeck_friction_static, weight)
    return friction + load_friction(motor, machine.load_dependent_friction_coefficient)


@compiled
def viscous(machine: Machine, direction: float, time: float) -> float:
    """Viscous damping of motion in this direction (±1) at this time."""
    damping = directed(machine.viscous_damping, machine.asymmetric_friction_viscous, direction)
    return drifted(damping, machine.thermal_drift_rate, time)


@compiled
def advance(
    machine: Machine,
    velocity: float,
    torque: float,
    weight: float,
    motor: float,
    ahead: Glide,
    back: Glide,
    inertia: float,
    step: float,
    whole: bool,
) -> tuple[float, float, float]:
    """Motion with friction under a constant torque until `step` is over, or until it comes to rest if that is sooner.

    `ahead` and `back` are what viscous damping makes of motion in the positive and the negative direction, in a whole
    step. Returns the distance, the velocity and the time used. A joint at rest stays there all the step if friction
    can hold it.
    """
    # What both directions would be like, for the processor to begin with before it knows the velocity's sign.
    net_ahead = torque - dry(machine, 1.0, weight, motor)
    net_back = torque + dry(machine, -1.0, weight, motor)
    if velocity == 0:
        direction = direction_of(velocity, torque)
        if abs(torque) <= dry(machine, direction, 1.0, motor) or (net_ahead <= 0 <= net_back):
            return 0.0, 0.0, step
    else:
        direction = 1.0 if velocity > 0 else -1.0
    net = net_ahead if direction > 0 else net_back
    damping, (e, g, a, b) = ahead if direction > 0 else back
    if not whole:
        e, g, a, b = response(damping, inertia, step)
    after = e * velocity + g * net
    if direction * after <= 0 and velocity != 0 and direction * net < 0:
        time = min(time_to_stop(velocity, net, damping, inertia), step)
        _, _, a, b = response(damping, inertia, time)
        return a * velocity + b * net, 0.0, time
    return a * velocity + b * net, after, step


@compiled
def glide(damping: float, inertia: float, step: float) -> Glide:
    """What viscous damping makes of motion in one direction."""
    return damping, response(damping, inertia, step)


@compiled
def glides(
    machine: Machine, time: float, inertia: float, steps: tuple[float, float]
) -> tuple[tuple[Glide, Glide], tuple[Glide, Glide]]:
    """`glide` ahead and back at this time, in the steps of both segments of a sample."""
    ahead, back = viscous(machine, 1.0, time), viscous(machine, -1.0, time)
    return (
        (glide(ahead, inertia, steps[0]), glide(back, inertia, steps[0])),
        (glide(ahead, inertia, steps[1]), glide(back, inertia, steps[1])),
    )
