"""A joint whose motor and load are divided by play, by a spring, or by both."""

import math

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import commanded, glides, needs_velocity, on_load, on_motor, viscous, weight_at
from vision_s2r.joint.effects.inertia import half
from vision_s2r.joint.effects.latency import split_delay
from vision_s2r.joint.log import Log, correction, segments, sent
from vision_s2r.joint.machine import Machine
from vision_s2r.joint.play import play_step, play_velocity
from vision_s2r.joint.spring import spring_responses, spring_step, spring_velocity


@compiled
def two_masses(machine: Machine, tables: np.ndarray, heights: np.ndarray, log: Log, out: np.ndarray) -> None:
    """An episode of a joint with play or a spring, into `out` [T, 2].

    As with one mass, torques are taken in the middle of a step; where they depend on velocity, it is predicted.
    """
    whole, fraction = split_delay(machine.latency_delay, log.sample_time)
    counts, steps = segments(fraction, log.sample_time, log.substeps)
    sprung = machine.compliance_stiffness < math.inf
    responses = np.empty((2, 4, 4, 5))
    if sprung:
        spring_responses(machine, steps[0], responses[0])
        spring_responses(machine, steps[1], responses[1])
    state = (log.first[1], log.first[1], 0.0, log.first[0], 0.0)
    weight = weight_at(machine, log.first[1])
    other = on_motor(machine, tables, heights, log.first[0], log.first[1], 0.0)
    fast = not needs_velocity(machine, tables)
    for k in range(len(out)):
        v_motor, v_load, twist, position, side = state
        out[k, 0], out[k, 1] = position, v_load
        if log.leak > 0:
            position += correction(log.leak, log.observed[k, 0], position)
            change = correction(log.leak, log.observed[k, 1], v_load)
            state = (v_motor + change, v_load + change, twist, position, side)
        time = k * log.sample_time
        if k == 0 or machine.thermal_drift_rate != 0:
            midway = time + 0.5 * log.sample_time
            damping = (viscous(machine, 1.0, midway), viscous(machine, -1.0, midway))
            joined = glides(machine, midway, machine.inertia, steps)
            alone = glides(machine, midway, half(machine.inertia), steps)
        for segment in range(2):
            current = sent(log.command, k - whole - 1 + segment)
            step = steps[segment]
            for _ in range(counts[segment]):
                v_motor, v_load, twist, position, side = state
                middle = v_motor
                if not fast:
                    motor = commanded(machine, current, v_motor)
                    load = on_load(machine, position)
                    if sprung:
                        spring = responses[segment]
                        ahead = spring_velocity(machine, state, weight, motor, motor + other, load, damping, spring)
                    else:
                        ahead = play_velocity(
                            machine, state, weight, motor, motor + other, load, joined[segment], alone[segment], step
                        )
                    middle = 0.5 * (v_motor + ahead)
                    weight = weight_at(machine, middle)
                motor = commanded(machine, current, middle)
                shaft = position + twist + 0.5 * step * middle
                other = on_motor(machine, tables, heights, shaft, middle, time + 0.5 * step)
                load = on_load(machine, position + 0.5 * step * v_load)
                if sprung:
                    spring = responses[segment]
                    state = spring_step(machine, state, weight, motor, motor + other, load, damping, spring, step)
                else:
                    state = play_step(
                        machine, state, weight, motor, motor + other, load, joined[segment], alone[segment], step
                    )
                time += step
