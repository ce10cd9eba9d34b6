"""A joint whose motor and load move as one.

Second order in the step: torques that depend on position, velocity or time are taken in its middle; inertia, damping
and dry friction under them are solved exactly, coming to rest and breaking loose within the step included. The bare
nominal joint without gravity is exact at any step.
"""

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import (
    Given,
    Glide,
    Weight,
    advance,
    commanded,
    glides,
    held,
    needs_velocity,
    on_load,
    on_motor,
    weight_at,
)
from vision_s2r.joint.effects.latency import split_delay
from vision_s2r.joint.log import JointLog, correction, segments, sent
from vision_s2r.joint.machine import JointMachine

State = tuple[float, float, Weight, float]  # position, velocity, and weight and other torque as the last step had them
Paths = tuple[tuple[Glide, Glide], tuple[Glide, Glide]]


@compiled
def one_mass(machine: JointMachine, tables: np.ndarray, heights: np.ndarray, log: JointLog, out: np.ndarray) -> None:
    """An episode of a joint without play or spring, into `out` [T, 2]."""
    whole, fraction = split_delay(machine.latency_delay, log.sample_time)
    counts, steps = segments(fraction, log.sample_time, log.substeps)
    paths = glides(machine, 0.5 * log.sample_time, machine.inertia, steps)
    state = one_mass_start(machine, tables, heights, log.first[0], log.first[1])
    fast = not needs_velocity(machine, tables)
    for k in range(len(out)):
        position, velocity, weight, other = state
        out[k, 0], out[k, 1] = position, velocity
        if log.leak > 0:
            position += correction(log.leak, log.observed[2 * k], position)
            velocity += correction(log.leak, log.observed[2 * k + 1], velocity)
            state = (position, velocity, weight, other)
        time = k * log.sample_time
        if machine.thermal_drift_rate != 0:
            paths = glides(machine, time + 0.5 * log.sample_time, machine.inertia, steps)
        given = (held(sent(log.command, k - whole - 1)), held(sent(log.command, k - whole)))
        state = one_mass_sample(machine, tables, heights, state, given, time, counts, steps, paths, fast)


@compiled
def one_mass_start(
    machine: JointMachine, tables: np.ndarray, heights: np.ndarray, position: float, velocity: float
) -> State:
    """The state of a joint that nothing has moved yet."""
    other = on_motor(machine, tables, heights, position, velocity, 0.0) + on_load(machine, position)
    return position, velocity, weight_at(machine, velocity), other


@compiled
def one_mass_sample(
    machine: JointMachine,
    tables: np.ndarray,
    heights: np.ndarray,
    state: State,
    given: tuple[Given, Given],  # before and after the command changes within the sample
    time: float,  # at the start of the sample
    counts: tuple[int, int],
    steps: tuple[float, float],
    paths: Paths,
    fast: bool,  # no torque needs the velocity in the middle of the step
) -> State:
    """The state a sample later."""
    position, velocity, weight, other = state
    for segment in range(2):
        step = steps[segment]
        ahead, back = paths[segment]
        for _ in range(counts[segment]):
            position, velocity, weight, other = _step(
                machine,
                tables,
                heights,
                position,
                velocity,
                weight,
                other,
                given[segment],
                time + 0.5 * step,
                ahead,
                back,
                step,
                fast,
            )
            time += step
    return position, velocity, weight, other


@compiled
def middle_velocity(
    machine: JointMachine,
    tables: np.ndarray,
    heights: np.ndarray,
    state: State,
    given: Given,
    paths: tuple[Glide, Glide],  # ahead and back
    step: float,
) -> float:
    """The velocity in the middle of a step as far as the torques at its start tell."""
    position, velocity, weight, other = state
    motor = commanded(machine, tables, heights, given, position, velocity, velocity)
    pressed = machine.external_load_friction_coefficient > 0
    loads = motor, on_load(machine, position) + given[4] if pressed else 0.0
    _, after, _ = advance(
        machine, velocity, motor + other, weight, loads, paths[0], paths[1], machine.inertia, step, True
    )
    return 0.5 * (velocity + after)


@compiled
def _step(
    machine: JointMachine,
    tables: np.ndarray,
    heights: np.ndarray,
    position: float,
    velocity: float,
    weight: Weight,  # of static friction, as the last step had it
    other: float,  # torque beside the commanded one, as the last step had it
    given: Given,
    time: float,  # in the middle of the step
    ahead: Glide,
    back: Glide,
    step: float,
    fast: bool,  # no torque needs the velocity in the middle of the step
) -> State:
    """Position, velocity, and the weight and other torque in the middle of the step."""
    middle = velocity
    if not fast:
        middle = middle_velocity(
            machine, tables, heights, (position, velocity, weight, other), given, (ahead, back), step
        )
        weight = weight_at(machine, middle)
    halfway = position + 0.5 * step * middle
    motor = commanded(machine, tables, heights, given, halfway, middle, middle)
    loads = motor, on_load(machine, halfway) + given[4]
    other = on_motor(machine, tables, heights, halfway, middle, time) + loads[1]
    torque = motor + other
    distance, velocity, used = advance(
        machine, velocity, torque, weight, loads, ahead, back, machine.inertia, step, True
    )
    position += distance
    if used < step:  # came to rest: held for the remaining time, or driven back
        weight, left = weight_at(machine, 0.0), step - used
        distance, velocity, _ = advance(machine, 0.0, torque, weight, loads, ahead, back, machine.inertia, left, False)
        position += distance
    return position, velocity, weight, other
