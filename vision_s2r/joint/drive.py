"""The torques of a drive, and its dry friction: the effects' formulas put together.

Everything here is compiled, a machine being the `JointMachine` tuple and `tables` what `tables.py` says.
"""

import math

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effects.asymmetric_friction import directed
from vision_s2r.joint.effects.back_emf import back_emf
from vision_s2r.joint.effects.bias_torque import bias
from vision_s2r.joint.effects.coulomb_friction import direction_of
from vision_s2r.joint.effects.deadband import beyond
from vision_s2r.joint.effects.encoder_quantization import rounded
from vision_s2r.joint.effects.gravity_torque import gravity
from vision_s2r.joint.effects.load_dependent_friction import load_friction
from vision_s2r.joint.effects.proportional_gain import servo_command
from vision_s2r.joint.effects.stribeck_friction import stribeck, stribeck_weight
from vision_s2r.joint.effects.thermal_drift import drifted
from vision_s2r.joint.effects.torque_constant import motor_torque
from vision_s2r.joint.effects.torque_saturation import saturate
from vision_s2r.joint.effects.torque_speed_limit import limit_by_speed
from vision_s2r.joint.effects.viscous_damping import Response, response, time_to_stop
from vision_s2r.joint.machine import JointMachine
from vision_s2r.joint.slot import slot_needs_velocity, slot_on, slot_torque
from vision_s2r.joint.tables import look_up, look_up_drive

Glide = tuple[float, Response]  # of motion in one direction: its damping, and the response of a whole step
# Of a servo's error, what its derivative is taken from: the error as a low pass has it, and what is asked for each
# rad between the two, in units of u.
Lag = tuple[float, float]
# What acts in a step: the command at its start and at its end (a position servo's is its target), for which share of it
# the latter acts, the factor of u, and the torque on the load.
Given = tuple[float, float, float, float, float, Lag]
Weight = tuple[float, float]  # of static friction, and of that under load: 1 at rest
REST: Weight = (1.0, 1.0)
NO_LAG: Lag = (0.0, 0.0)
Loads = tuple[float, float]  # what presses the gears: the motor's torque, and the torque on the load


@compiled
def needs_velocity(machine: JointMachine, tables: np.ndarray) -> bool:
    """Whether any torque but viscous damping and Coulomb friction depends on velocity."""
    stribeck_on = not math.isnan(machine.stribeck_friction_static) or machine.load_dependent_stribeck_coefficient > 0
    limited = machine.torque_speed_limit_no_load_speed < math.inf or machine.back_emf > 0
    served = machine.derivative_gain > 0 or machine.derivative_on_error_gain > 0
    return stribeck_on or limited or tables[1, 2] > 0 or served or slot_needs_velocity(machine)


@compiled
def steady(machine: JointMachine, heights: np.ndarray) -> bool:
    """Whether a command held makes one torque in one direction, apart from viscous damping."""
    fixed = math.isnan(machine.stribeck_friction_static) and machine.torque_speed_limit_stall == math.inf
    fixed = fixed and machine.load_dependent_stribeck_coefficient == 0 and machine.back_emf == 0
    return fixed and machine.gravity_torque == 0 and not slot_on(machine) and len(heights) == 0


@compiled
def served(machine: JointMachine, target: float, position: float, velocity: float, lag: Lag) -> float:
    """What a position servo asks of its motor when the load is here and moves so, in units of u."""
    whole = target - counted(machine, position)
    error = beyond(whole, machine.deadband_width)
    if machine.deadband_width > 0 and error == 0:
        return 0.0
    more = lag[1] * (whole - lag[0])
    gains = machine.proportional_gain, machine.derivative_gain
    return servo_command(error, velocity, more, gains[0], gains[1], machine.command_limit)


@compiled
def counted(machine: JointMachine, position: float) -> float:
    """The position as the encoder shows it."""
    if machine.encoder_quantization_resolution > 0:
        return rounded(position, machine.encoder_quantization_resolution, machine.encoder_quantization_offset)
    return position


@compiled
def held(command: float) -> Given:
    """A command that acts all the step, and nothing else."""
    return command, command, 0.0, 1.0, 0.0, NO_LAG


@compiled
def commanded(
    machine: JointMachine,
    tables: np.ndarray,
    heights: np.ndarray,
    given: Given,
    position: float,
    load_velocity: float,
    velocity: float,
) -> float:
    """Mean motor torque in a step, where the load is about here, at its and the motor's velocity."""
    torque = _motor(machine, given[0], given[3], position, load_velocity, velocity, given[5])
    if given[2] > 0:
        later = _motor(machine, given[1], given[3], position, load_velocity, velocity, given[5])
        torque += given[2] * (later - torque)
    return torque + look_up_drive(tables, heights, torque)


@compiled
def _motor(
    machine: JointMachine,
    current: float,
    factor: float,
    position: float,
    load_velocity: float,
    velocity: float,
    lag: Lag,
) -> float:
    if not math.isnan(machine.proportional_gain):
        current = served(machine, current, position, load_velocity, lag)
    torque = saturate(motor_torque(current * factor, machine.torque_constant), machine.torque_saturation_limit)
    if machine.torque_speed_limit_stall < math.inf:
        torque = limit_by_speed(
            torque, velocity, machine.torque_speed_limit_stall, machine.torque_speed_limit_no_load_speed
        )
    return torque + back_emf(machine.back_emf, factor, velocity)


@compiled
def on_motor(
    machine: JointMachine, tables: np.ndarray, heights: np.ndarray, position: float, velocity: float, time: float
) -> float:
    """Torque on the motor beside the commanded one and friction."""
    return slot_torque(machine, position, velocity, time) + look_up(tables, heights, position, velocity, time)


@compiled
def on_load(machine: JointMachine, position: float) -> float:
    """Torque on the load, at a position that the encoder shows."""
    return gravity(position - machine.position_offset, machine.gravity_torque) + bias(machine.bias_torque)


@compiled
def weight_at(machine: JointMachine, velocity: float) -> Weight:
    """How much of the static frictions is felt: 1 at rest. 0 where friction does not know rest from motion."""
    static, loaded = 0.0, 0.0
    if not math.isnan(machine.stribeck_friction_static):
        static = stribeck_weight(velocity, machine.stribeck_friction_velocity)
    if machine.load_dependent_stribeck_coefficient > 0:
        loaded = stribeck_weight(velocity, machine.load_dependent_stribeck_velocity)
    return static, loaded


@compiled
def dry(machine: JointMachine, direction: float, weight: Weight, loads: Loads) -> float:
    """Dry friction against motion in this direction (±1) under these torques."""
    friction = directed(machine.coulomb_friction, machine.asymmetric_friction_coulomb, direction)
    if not math.isnan(machine.stribeck_friction_static):
        friction = stribeck(friction, machine.stribeck_friction_static, weight[0])
    coefficient = machine.load_dependent_friction_coefficient + weight[1] * machine.load_dependent_stribeck_coefficient
    return friction + load_friction(coefficient * loads[0], machine.external_load_friction_coefficient * loads[1])


@compiled
def viscous(machine: JointMachine, direction: float, time: float) -> float:
    """Viscous damping of motion in this direction (±1) at this time."""
    damping = directed(machine.viscous_damping, machine.asymmetric_friction_viscous, direction)
    return drifted(damping, machine.thermal_drift_rate, time)


@compiled
def advance(
    machine: JointMachine,
    velocity: float,
    torque: float,
    weight: Weight,
    loads: Loads,
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
    net_ahead = torque - dry(machine, 1.0, weight, loads)
    net_back = torque + dry(machine, -1.0, weight, loads)
    if velocity == 0:
        direction = direction_of(velocity, torque)
        if abs(torque) <= dry(machine, direction, REST, loads) or (net_ahead <= 0 <= net_back):
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
    machine: JointMachine, time: float, inertia: float, steps: tuple[float, float]
) -> tuple[tuple[Glide, Glide], tuple[Glide, Glide]]:
    """`glide` ahead and back at this time, in the steps of both segments of a sample."""
    damping = viscous(machine, 1.0, time), viscous(machine, -1.0, time)
    later = _both_ways(damping, inertia, steps[1])
    return (later if steps[0] == steps[1] else _both_ways(damping, inertia, steps[0])), later


@compiled
def _both_ways(damping: tuple[float, float], inertia: float, step: float) -> tuple[Glide, Glide]:
    """`glide` ahead and back; one, where they are the same: exponentials take long."""
    ahead = glide(damping[0], inertia, step)
    return ahead, (ahead if damping[0] == damping[1] else glide(damping[1], inertia, step))
