"""All joints of an arm, step by step, compiled: drives that share rigid bodies.

Each joint's drive is stepped by the functions of `vision_s2r.joint`, with the accelerations of all others as a load.
A joint's own acceleration depends on its load alone, and mostly along a line: accelerations that agree are found by
secants of all joints together, and where dry friction or play has them jump from line to line, joint by joint with the
newest of the others (Gauss and Seidel): M is positive definite.
"""

import inspect
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
from vision_s2r.joint.drive import Given, glides, needs_velocity
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
SWEEPS, SECANTS = 100, 8  # at most, and how many of them are of all joints together
DIFFERENT = 1e-9  # of two loads, that a slope is taken between
AGREED = 1e-6  # rad/s (m/s) of the velocities after a step
EASE = 0.5  # of the way to its new acceleration that a joint of two masses goes in a sweep
ROUNDING = 1e-6  # of a part of the time between two rows

_WIDTH = len(COLUMNS)


@compiled
def log_of(command: np.ndarray, first: np.ndarray, step: float, times: np.ndarray) -> JointLog:
    """A joint's commands; nothing is observed, and all else is the arm's."""
    none, ends = pointer(times), (first[0], first[1])
    inputs = (pointer(times), (False, False, False), none, 1, none, none)
    return JointLog(len(command), pointer(command), ends, none, 0.0, step, 1, *inputs)


@compiled
def _driven(
    machine: JointMachine,
    tables: np.ndarray,
    before: np.ndarray,  # [STATE]
    after: np.ndarray,  # [STATE], to be written
    acting: Given,
    time: float,
    step: float,
    responses: np.ndarray,
) -> float:
    """Step one joint; the part of the way to its new acceleration that it may go at once."""
    none = np.empty(0)
    fast = not needs_velocity(machine, tables)
    if machine.backlash_width == 0 and not sprung(machine):
        paths = glides(machine, time + 0.5 * step, machine.inertia, (step, step))
        one = (before[0], before[1], (before[2], before[3]), before[4])
        one = one_mass_sample(machine, tables, none, one, (acting, acting), time, (0, 1), (step, step), paths, fast)
        after[0], after[1], (after[2], after[3]), after[4] = one
        return 1.0
    both = two_masses_paths(machine, time + 0.5 * step, (step, step))
    masses = ((before[5], before[1], before[6], before[0], before[7]), (before[2], before[3]), before[4])
    masses = two_masses_sample(
        machine, tables, none, masses, (acting, acting), time, (0, 1), (step, step), both, responses, fast
    )
    (after[5], after[1], after[6], after[0], after[7]), weight, after[4] = masses
    after[2], after[3] = weight
    return EASE


@compiled
def _agree(
    mass: np.ndarray, bias: np.ndarray, slopes: np.ndarray, loads: np.ndarray, found: np.ndarray, rates: np.ndarray
) -> None:
    """Accelerations [J], into `rates`, of which each is on the line of this slope through what its load made of it."""
    joints = len(rates)
    system = np.empty((joints, joints))
    for j in range(joints):
        for k in range(joints):
            system[j, k] = 1.0 if j == k else slopes[j] * mass[j, k]
    known = found - slopes * (bias + loads)
    rates[:] = np.linalg.solve(system, known) if np.isfinite(known).all() else found


@compiled
def _advance(
    machines: np.ndarray,  # [J, P]
    command: np.ndarray,  # [J, T]
    times: np.ndarray,  # [T]
    first: np.ndarray,  # [J, 2]
    rows: np.ndarray,  # [J, 2] of the commands that act
    points: np.ndarray,  # [J, 3] set point, its rate, and the error that a servo's derivative has
    states: np.ndarray,  # [J, STATE]
    rates: np.ndarray,  # [J] accelerations
    slopes: np.ndarray,  # [J] by which they change with the loads
    mass: np.ndarray,  # [J, J] without rotors
    bias: np.ndarray,  # [J]
    tables: np.ndarray,
    time: float,
    step: float,
    row: int,
    out: np.ndarray,  # [J, T, 2]
) -> int:
    """Step; the next row to be written."""
    joints = len(machines)
    before, after = states.copy(), states
    responses = np.empty((joints, *RESPONSES))
    given = np.empty((joints, 6))
    for j in range(joints):
        machine = JointMachine(*to_fixed_tuple(machines[j], _WIDTH))  # type: ignore[call-arg]
        log = log_of(command[j], first[j], step, times)
        cursor = (rows[j, 0], rows[j, 1], points[j, 0], points[j, 1], points[j, 2])
        acting, cursor = inputs_of(machine, log, cursor, time, step, (before[j, 0], before[j, 1]))
        rows[j, 0], rows[j, 1], points[j, 0], points[j, 1], points[j, 2] = cursor
        given[j, 0], given[j, 1], given[j, 2], given[j, 3], _, (given[j, 4], given[j, 5]) = acting
        if sprung(machine):
            machine = of_inertia(machine, machine.inertia + mass[j, j])
            two_masses_responses(machine, (step, step), responses[j])
    loads, found = np.zeros(joints), np.zeros(joints)
    for sweep in range(SWEEPS):
        change = 0.0
        for j in range(joints):
            machine = JointMachine(*to_fixed_tuple(machines[j], _WIDTH))  # type: ignore[call-arg]
            machine = of_inertia(machine, machine.inertia + mass[j, j])
            load = mass[j, j] * rates[j] - bias[j]
            for k in range(joints):
                load -= mass[j, k] * rates[k]
            acting = (given[j, 0], given[j, 1], given[j, 2], given[j, 3], load, (given[j, 4], given[j, 5]))
            ease = _driven(machine, tables, before[j], after[j], acting, time, step, responses[j])
            rate = (after[j, 1] - before[j, 1]) / step
            change = max(change, abs(rate - rates[j]) * step)
            if sweep > 0 and abs(load - loads[j]) > DIFFERENT * (abs(load) + abs(loads[j])):
                slopes[j] = min(max((rate - found[j]) / (load - loads[j]), 0.0), 1 / mass[j, j])
            loads[j], found[j] = load, rate
            if sweep >= SECANTS:
                rates[j] += ease * (rate - rates[j])
        if change < AGREED or not np.isfinite(found).all():
            rates[:] = found
            break
        if sweep < SECANTS:
            _agree(mass, bias, slopes, loads, found, rates)
    following = row
    for j in range(joints):
        log = log_of(command[j], first[j], step, times)
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
        points = np.full((joints, 3), np.nan)
        points[:, 0], points[:, 1] = first[:, 0], 0.0
        mass, bias, slopes = np.empty((joints, joints)), np.empty(joints), np.zeros(joints)
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
                machines,
                command,
                times,
                first,
                acting,
                points,
                states,
                rates,
                slopes,
                mass,
                bias,
                tables,
                time,
                step,
                row,
                out,
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
