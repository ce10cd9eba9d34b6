"""A joint whose motor and load are divided by play, by a spring, or by both."""

import math

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import (
    Given,
    Weight,
    commanded,
    glides,
    held,
    needs_velocity,
    on_load,
    on_motor,
    viscous,
    weight_at,
)
from vision_s2r.joint.effects.inertia import half
from vision_s2r.joint.effects.latency import split_delay
from vision_s2r.joint.log import JointLog, correction, segments, sent
from vision_s2r.joint.machine import JointMachine
from vision_s2r.joint.one_mass import Paths
from vision_s2r.joint.play import State, play_step, play_velocities
from vision_s2r.joint.spring import spring_responses, spring_step, spring_velocities

RESPONSES = (2, 4, 4, 5)  # the shape of what a spring does, in either segment of a sample

Masses = tuple[State, Weight, float]  # and weight and other torque as the last step had them
MassPaths = tuple[tuple[float, float], Paths, Paths]  # damping, and motion of both masses together, of one alone


@compiled
def two_masses(machine: JointMachine, tables: np.ndarray, heights: np.ndarray, log: JointLog, out: np.ndarray) -> None:
    """An episode of a joint with play or a spring, into `out` [T, 2].

    As with one mass, torques are taken in the middle of a step; where they depend on velocity, it is predicted.
    """
    whole, fraction = split_delay(machine.latency_delay, log.sample_time)
    counts, steps = segments(fraction, log.sample_time, log.substeps)
    responses = np.empty(RESPONSES)
    if sprung(machine):
        two_masses_responses(machine, steps, responses)
    masses = two_masses_start(machine, tables, heights, log.first[0], log.first[1])
    paths = two_masses_paths(machine, 0.5 * log.sample_time, steps)
    fast = not needs_velocity(machine, tables)
    for k in range(len(out)):
        (v_motor, v_load, twist, position, side), weight, other = masses
        out[k, 0], out[k, 1] = position, v_load
        if log.leak > 0:
            position += correction(log.leak, log.observed[2 * k], position)
            change = correction(log.leak, log.observed[2 * k + 1], v_load)
            masses = ((v_motor + change, v_load + change, twist, position, side), weight, other)
        time = k * log.sample_time
        if machine.thermal_drift_rate != 0:
            paths = two_masses_paths(machine, time + 0.5 * log.sample_time, steps)
        given = (held(sent(log.command, k - whole - 1)), held(sent(log.command, k - whole)))
        masses = two_masses_sample(machine, tables, heights, masses, given, time, counts, steps, paths, responses, fast)


@compiled
def sprung(machine: JointMachine) -> bool:
    """Whether a spring divides motor and load."""
    return machine.compliance_stiffness < math.inf


@compiled
def two_masses_responses(machine: JointMachine, steps: tuple[float, float], out: np.ndarray) -> None:
    """What the spring does in a step of either segment, into `out` RESPONSES."""
    spring_responses(machine, steps[1], out[1])
    if steps[0] == steps[1]:
        for k in range(RESPONSES[1]):  # no slice, whose error message takes as long to compile as all springs
            for row in range(RESPONSES[2]):
                for column in range(RESPONSES[3]):
                    out[0, k, row, column] = out[1, k, row, column]
    else:
        spring_responses(machine, steps[0], out[0])


@compiled
def two_masses_start(
    machine: JointMachine, tables: np.ndarray, heights: np.ndarray, position: float, velocity: float
) -> Masses:
    """The state of a joint that nothing has moved yet: in the middle of its play, its spring untwisted."""
    other = on_motor(machine, tables, heights, position, velocity, 0.0)
    return (velocity, velocity, 0.0, position, 0.0), weight_at(machine, velocity), other


@compiled
def two_masses_paths(machine: JointMachine, time: float, steps: tuple[float, float]) -> MassPaths:
    """What viscous damping is, and what it makes of motion, about this time."""
    damping = (viscous(machine, 1.0, time), viscous(machine, -1.0, time))
    joined = glides(machine, time, machine.inertia, steps)
    return damping, joined, glides(machine, time, half(machine.inertia), steps)


@compiled
def two_masses_sample(
    machine: JointMachine,
    tables: np.ndarray,
    heights: np.ndarray,
    masses: Masses,
    given: tuple[Given, Given],  # before and after the command changes within the sample
    time: float,  # at the start of the sample
    counts: tuple[int, int],
    steps: tuple[float, float],
    paths: MassPaths,
    responses: np.ndarray,
    fast: bool,  # no torque needs the velocity in the middle of the step
) -> Masses:
    """The state a sample later."""
    state, weight, other = masses
    damping, joined, alone = paths
    for segment in range(2):
        inputs = given[segment]
        step = steps[segment]
        for _ in range(counts[segment]):
            v_motor, v_load, twist, position, _ = state
            middle, load_middle = v_motor, v_load
            if not fast:
                motor = commanded(machine, tables, heights, inputs, position, v_load, v_motor)
                load = on_load(machine, position) + inputs[4]
                if sprung(machine):
                    spring = responses[segment]
                    after = spring_velocities(machine, state, weight, motor, motor + other, load, damping, spring)
                else:
                    after = play_velocities(
                        machine, state, weight, motor, motor + other, load, joined[segment], alone[segment], step
                    )
                middle, load_middle = 0.5 * (v_motor + after[0]), 0.5 * (v_load + after[1])
                weight = weight_at(machine, middle)
            motor = commanded(machine, tables, heights, inputs, position + 0.5 * step * v_load, load_middle, middle)
            shaft = position + twist + 0.5 * step * middle
            other = on_motor(machine, tables, heights, shaft, middle, time + 0.5 * step)
            load = on_load(machine, position + 0.5 * step * v_load) + inputs[4]
            if sprung(machine):
                spring = responses[segment]
                state = spring_step(machine, state, weight, motor, motor + other, load, damping, spring, step)
            else:
                state = play_step(
                    machine, state, weight, motor, motor + other, load, joined[segment], alone[segment], step
                )
            time += step
    return state, weight, other
