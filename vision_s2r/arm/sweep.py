"""All joints of an arm, step by step, compiled: drives that share rigid bodies.

Each joint's drive is stepped by the functions of `vision_s2r.joint`, with the accelerations of all others as a load.
These are swept, joint by joint with the newest of the others (Gauss and Seidel), until they agree: M is positive
definite.
"""

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vision_s2r.arm import rigid
from vision_s2r.arm.rigid import Rigid, terms
from vision_s2r.joint.clock import inputs_of, read_rows
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import glides, needs_velocity
from vision_s2r.joint.effects.encoder_quantization import quantize
from vision_s2r.joint.log import JointLog
from vision_s2r.joint.machine import COLUMNS, JointMachine, of_inertia
from vision_s2r.joint.one_mass import one_mass_sample, one_mass_start
from vision_s2r.joint.pointer import pointer
from vision_s2r.joint.simulation import digest
from vision_s2r.joint.two_masses import (
    RESPONSES,
    sprung,
    two_masses_paths,
    two_masses_responses,
    two_masses_sample,
    two_masses_start,
)

STATE = 8  # position, velocity; weight (2), other torque; the motor's velocity, twist and side of two masses
SWEEPS = 100
AGREED = 1e-6  # rad/s (m/s) of the velocities after a step
EASE = 0.5  # of the way to its new acceleration that a joint of two masses goes in a sweep
ROUNDING = 1e-6  # of a part of the time between two rows

_WIDTH = len(COLUMNS)


@compiled
def _log(command: np.ndarray, first: np.ndarray, step: float, times: np.ndarray) -> JointLog:
    """A joint's commands; nothing is observed, and all else is the arm's."""
    none, ends = pointer(times), (first[0], first[1])
    inputs = (pointer(times), (False, False, False), none, 1, none, none)
    return JointLog(len(command), pointer(command), ends, none, 0.0, step, 1, *inputs)


@compiled
def _advance(
    machines: np.ndarray,  # [J, P]
    command: np.ndarray,  # [J, T]
    times: np.ndarray,  # [T]
    first: np.ndarray,  # [J, 2]
    rows: np.ndarray,  # [J, 2] of the commands that act
    points: np.ndarray,  # [J, 2] set point and its rate
    states: np.ndarray,  # [J, STATE]
    rates: np.ndarray,  # [J] accelerations
    mass: np.ndarray,  # [J, J] without rotors
    bias: np.ndarray,  # [J]
    tables: np.ndarray,
    time: float,
    step: float,
    row: int,
    out: np.ndarray,  # [J, T, 2]
) -> int:
    """Step; the next row to be written."""
    none = np.empty(0)
    joints = len(machines)
    before, after = states.copy(), states
    responses = np.empty((joints, *RESPONSES))
    given = np.empty((joints, 5))
    for j in range(joints):
        machine = JointMachine(*to_fixed_tuple(machines[j], _WIDTH))  # type: ignore[call-arg]
        log = _log(command[j], first[j], step, times)
        cursor = (rows[j, 0], rows[j, 1], points[j, 0], points[j, 1])
        acting, cursor = inputs_of(machine, log, cursor, time, step)
        rows[j, 0], rows[j, 1], points[j, 0], points[j, 1] = cursor
        given[j, 0], given[j, 1], given[j, 2], given[j, 3], given[j, 4] = acting
        if sprung(machine):
            machine = of_inertia(machine, machine.inertia + mass[j, j])
            two_masses_responses(machine, (step, step), responses[j])
    for _ in range(SWEEPS):
        change = 0.0
        for j in range(joints):
            machine = JointMachine(*to_fixed_tuple(machines[j], _WIDTH))  # type: ignore[call-arg]
            machine = of_inertia(machine, machine.inertia + mass[j, j])
            load = mass[j, j] * rates[j] - bias[j]
            for k in range(joints):
                load -= mass[j, k] * rates[k]
            acting = (given[j, 0], given[j, 1], given[j, 2], given[j, 3], load)
            fast = not needs_velocity(machine, tables)
            old = before[j]
            if machine.backlash_width == 0 and not sprung(machine):
                paths = glides(machine, time + 0.5 * step, machine.inertia, (step, step))
                one = (old[0], old[1], (old[2], old[3]), old[4])
                one = one_mass_sample(
                    machine, tables, none, one, (acting, acting), time, (0, 1), (step, step), paths, fast
                )
                after[j, 0], after[j, 1], (after[j, 2], after[j, 3]), after[j, 4] = one
                ease = 1.0
            else:
                both = two_masses_paths(machine, time + 0.5 * step, (step, step))
                masses = ((old[5], old[1], old[6], old[0], old[7]), (old[2], old[3]), old[4])
                masses = two_masses_sample(
                    machine, tables, none, masses, (acting, acting), time, (0, 1), (step, step), both,
                    responses[j], fast,
                )  # fmt: skip
                (after[j, 5], after[j, 1], after[j, 6], after[j, 0], after[j, 7]), weight, after[j, 4] = masses
                after[j, 2], after[j, 3] = weight
                ease = EASE
            rate = (after[j, 1] - old[1]) / step
            change = max(change, abs(rate - rates[j]) * step)
            rates[j] += ease * (rate - rates[j])
        if change < AGREED or math.isnan(change):
            break
    following = row
    for j in range(joints):
        log = _log(command[j], first[j], step, times)
        ends = (before[j, 0], before[j, 1]), (after[j, 0], after[j, 1])
        following, _ = read_rows(log, row, time, step, ends[0], ends[1], pointer(out[j]))
    return following


def _compile(sources: str) -> tuple[Callable[..., Any], ...]:
    """The kernels; `sources` is part of what numba's cache knows them by."""

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def start(machines: np.ndarray, tables: np.ndarray, first: np.ndarray, states: np.ndarray) -> None:
        sources  # noqa: B018
        none = np.empty(0)
        for j in range(len(machines)):
            machine = JointMachine(*to_fixed_tuple(machines[j], _WIDTH))  # type: ignore[call-arg]
            position, velocity = first[j, 0], first[j, 1]
            if machine.backlash_width == 0 and not sprung(machine):
                _, _, weight, other = one_mass_start(machine, tables, none, position, velocity)
            else:
                _, weight, other = two_masses_start(machine, tables, none, position, velocity)
            states[j, 0], states[j, 1], states[j, 2], states[j, 3] = position, velocity, weight[0], weight[1]
            states[j, 4], states[j, 5], states[j, 6], states[j, 7] = other, velocity, 0.0, 0.0

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def run(
        bodies: Rigid,
        machines: np.ndarray,  # [J, P]
        command: np.ndarray,  # [J, T]
        times: np.ndarray,  # [T]
        first: np.ndarray,  # [J, 2]
        states: np.ndarray,  # [J, STATE] as `start` leaves them
        tables: np.ndarray,
        step: float,
        parts: int,  # of the time between two rows
        out: np.ndarray,  # [J, T', 2], whose first row is written
        load: np.ndarray,  # [T'·parts, J] the sum of what the rest of the arm puts on a joint, part by part
        steps: np.ndarray,  # [T'·parts] steps that begin in each
    ) -> None:
        """Step by step, until all rows are written or a state is no number."""
        sources  # noqa: B018
        joints, rates = len(machines), np.zeros(len(machines))
        acting = np.zeros((joints, 2), np.int64)  # rows of the commands that act
        acting[:, 0] = -1
        points = np.zeros((joints, 2))
        points[:, 0] = first[:, 0]
        mass, bias = np.empty((joints, joints)), np.empty(joints)
        halfway, place = np.empty(joints), np.empty(joints)
        row, count = 1, 0
        while row < out.shape[1]:
            for j in range(joints):
                halfway[j] = states[j, 1] + 0.5 * step * rates[j]
                place[j] = states[j, 0] + 0.25 * step * (states[j, 1] + halfway[j])
            terms(bodies, place, halfway, mass, bias)
            share = (count * step - times[row - 1]) / (times[row] - times[row - 1])
            at = (row - 1) * parts + min(int(share * parts + ROUNDING), parts - 1)
            time = count * step
            row = _advance(
                machines, command, times, first, acting, points, states, rates, mass, bias, tables, time, step, row, out
            )
            for j in range(joints):
                load[at, j] += mass[j, j] * rates[j] - bias[j]
                for k in range(joints):
                    load[at, j] -= mass[j, k] * rates[k]
            steps[at] += 1
            count += 1
            if not np.isfinite(states).all():
                break

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def show(machines: np.ndarray, sample_time: float, times: np.ndarray, out: np.ndarray) -> None:
        """What encoders show of the states in `out` [J, T, 2]."""
        sources  # noqa: B018
        for j in range(len(machines)):
            machine = JointMachine(*to_fixed_tuple(machines[j], _WIDTH))  # type: ignore[call-arg]
            if machine.encoder_quantization_resolution > 0:
                resolution, offset = machine.encoder_quantization_resolution, machine.encoder_quantization_offset
                quantize(out[j], resolution, sample_time, times, offset)

    return start, run, show


start, run, show = _compile(digest(Path(inspect.getfile(rigid))))
