"""All joints of an arm, step by step, compiled: drives that share rigid bodies.

Each joint's drive is stepped by the functions of `vision_s2r.joint`, with the accelerations of all others as a load.
A joint's own acceleration depends on its load alone, and mostly along a line: accelerations that agree are found by
secants of all joints together, and where dry friction or play has them jump from line to line, joint by joint with the
newest of the others (Gauss and Seidel): M is positive definite.
"""

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np

from vision_s2r.arm import rigid
from vision_s2r.arm.rigid import Rigid, terms
from vision_s2r.joint.clock import inputs_of, read_rows
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import Given, glides, needs_velocity
from vision_s2r.joint.effects.encoder_quantization import quantize
from vision_s2r.joint.log import JointLog
from vision_s2r.joint.machine import COLUMNS, JointMachine, machine_at, of_inertia
from vision_s2r.joint.one_mass import one_mass_sample, one_mass_start
from vision_s2r.joint.pointer import Pointer, pointer, shifted
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
GIVEN = 6  # what acts in a step, without the load
ROOM = STATE + GIVEN + 6  # numbers for each joint that a step is worked out in
SWEEPS, SECANTS = 100, 8  # at most, and how many of them are of all joints together
DIFFERENT = 1e-9  # of two loads, that a slope is taken between
AGREED = 1e-6  # rad/s (m/s) of the velocities after a step
EASE = 0.5  # of the way to its new acceleration that a joint of two masses goes in a sweep
ROUNDING = 1e-6  # of a part of the time between two rows

_WIDTH = len(COLUMNS)


@compiled
def log_of(command: Pointer, samples: int, first: tuple[float, float], step: float, times: Pointer) -> JointLog:
    """A joint's commands; nothing is observed, and all else is the arm's."""
    inputs = (times, (False, False, False), times, 1, times, times)
    return JointLog(samples, command, first, times, 0.0, step, 1, *inputs)


class Scratch(NamedTuple):
    """What a step of J joints writes on."""

    before: Pointer  # [J, STATE] states
    given: Pointer  # [J, GIVEN] what acts on a joint beside its load
    loads: Pointer  # [J] of the last sweep
    found: Pointer  # [J] accelerations under these
    system: Pointer  # [J, J]
    responses: np.ndarray  # [J, *RESPONSES] of springs
    none: np.ndarray  # [0]


@compiled
def _driven(
    machine: JointMachine,
    tables: np.ndarray,
    before: Pointer,  # [STATE]
    after: Pointer,  # [STATE], to be written
    acting: Given,
    time: float,
    step: float,
    scratch: Scratch,
    j: int,
) -> float:
    """Step one joint; the part of the way to its new acceleration that it may go at once."""
    fast, none = not needs_velocity(machine, tables), scratch.none
    if machine.backlash_width == 0 and not sprung(machine):
        paths = glides(machine, time + 0.5 * step, machine.inertia, (step, step))
        one = (before[0], before[1], (before[2], before[3]), before[4])
        one = one_mass_sample(machine, tables, none, one, (acting, acting), time, (0, 1), (step, step), paths, fast)
        after[0], after[1], (after[2], after[3]), after[4] = one
        return 1.0
    both = two_masses_paths(machine, time + 0.5 * step, (step, step))
    masses = ((before[5], before[1], before[6], before[0], before[7]), (before[2], before[3]), before[4])
    masses = two_masses_sample(
        machine, tables, none, masses, (acting, acting), time, (0, 1), (step, step), both, scratch.responses[j], fast
    )
    (after[5], after[1], after[6], after[0], after[7]), weight, after[4] = masses
    after[2], after[3] = weight
    return EASE


@compiled
def _agree(joints: int, mass: Pointer, bias: Pointer, slopes: Pointer, scratch: Scratch, rates: Pointer) -> None:
    """Accelerations [J], into `rates`, of which each is on the line of this slope through what its load made of it.

    Rows of slope 0 apart, the system is a positive definite one whose rows are scaled: it needs no pivots.
    """
    system, loads, found = scratch.system, scratch.loads, scratch.found
    for j in range(joints):
        for k in range(joints):
            system[j * joints + k] = 1.0 if j == k else slopes[j] * mass[j * joints + k]
        rates[j] = found[j] - slopes[j] * (bias[j] + loads[j])
    for j in range(joints):
        for below in range(j + 1, joints):
            times = system[below * joints + j] / system[j * joints + j]
            rates[below] -= times * rates[j]
            for k in range(j + 1, joints):
                system[below * joints + k] -= times * system[j * joints + k]
    for j in range(joints - 1, -1, -1):
        for k in range(j + 1, joints):
            rates[j] -= system[j * joints + k] * rates[k]
        rates[j] /= system[j * joints + j]


class Arm(NamedTuple):
    """An arm in one episode: J joints, T rows."""

    joints: int
    rows: int
    machines: Pointer  # [J, P]
    command: Pointer  # [J, T]
    times: Pointer  # [T]
    first: Pointer  # [J, 2]
    tables: np.ndarray
    step: float


class Moving(NamedTuple):
    """Its state, and what its bodies are then."""

    acting: np.ndarray  # [J, 2] rows of the commands that act
    points: Pointer  # [J, 3] set point, its rate, and the error that a servo's derivative has
    states: Pointer  # [J, STATE]
    rates: Pointer  # [J] accelerations
    slopes: Pointer  # [J] by which they change with the loads
    mass: Pointer  # [J, J] without rotors
    bias: Pointer  # [J]


@compiled
def _load(arm: Arm, now: Moving, j: int) -> float:
    """What the rest of the arm puts on a joint."""
    load = now.mass[j * arm.joints + j] * now.rates[j] - now.bias[j]
    for k in range(arm.joints):
        load -= now.mass[j * arm.joints + k] * now.rates[k]
    return load


@compiled
def _machine(arm: Arm, j: int) -> JointMachine:
    return machine_at(shifted(arm.machines, j * _WIDTH))


@compiled
def _log(arm: Arm, j: int) -> JointLog:
    ends = (arm.first[2 * j], arm.first[2 * j + 1])
    return log_of(shifted(arm.command, j * arm.rows), arm.rows, ends, arm.step, arm.times)


@compiled
def _commanded(arm: Arm, now: Moving, scratch: Scratch, time: float) -> None:
    """What acts on each joint in a step, beside its load, and what springs do in it."""
    given, points = scratch.given, now.points
    for j in range(arm.joints):
        machine, before = _machine(arm, j), shifted(scratch.before, j * STATE)
        cursor = (now.acting[j, 0], now.acting[j, 1], points[3 * j], points[3 * j + 1], points[3 * j + 2])
        acting, cursor = inputs_of(machine, _log(arm, j), cursor, time, arm.step, (before[0], before[1]))
        now.acting[j, 0], now.acting[j, 1], points[3 * j], points[3 * j + 1], points[3 * j + 2] = cursor
        at = j * GIVEN
        given[at], given[at + 1], given[at + 2], given[at + 3], _, (given[at + 4], given[at + 5]) = acting
        if sprung(machine):
            machine = of_inertia(machine, machine.inertia + now.mass[j * arm.joints + j])
            two_masses_responses(machine, (arm.step, arm.step), scratch.responses[j])


@compiled
def _advance(arm: Arm, now: Moving, scratch: Scratch, time: float) -> None:
    """Step."""
    joints, step, given = arm.joints, arm.step, scratch.given
    for k in range(joints * STATE):
        scratch.before[k] = now.states[k]
    _commanded(arm, now, scratch, time)
    for sweep in range(SWEEPS):
        change, broken = 0.0, False
        for j in range(joints):
            own = now.mass[j * joints + j]
            machine = _machine(arm, j)
            machine = of_inertia(machine, machine.inertia + own)
            before, after = shifted(scratch.before, j * STATE), shifted(now.states, j * STATE)
            load, at = _load(arm, now, j), j * GIVEN
            acting = (given[at], given[at + 1], given[at + 2], given[at + 3], load, (given[at + 4], given[at + 5]))
            ease = _driven(machine, arm.tables, before, after, acting, time, step, scratch, j)
            rate = (after[1] - before[1]) / step
            change = max(change, abs(rate - now.rates[j]) * step)
            broken |= not math.isfinite(rate)
            last = scratch.loads[j]
            if sweep > 0 and abs(load - last) > DIFFERENT * (abs(load) + abs(last)):
                now.slopes[j] = min(max((rate - scratch.found[j]) / (load - last), 0.0), 1 / own)
            scratch.loads[j], scratch.found[j] = load, rate
            if sweep >= SECANTS:
                now.rates[j] += ease * (rate - now.rates[j])
        if change < AGREED or broken:
            for j in range(joints):
                now.rates[j] = scratch.found[j]
            break
        if sweep < SECANTS:
            _agree(joints, now.mass, now.bias, now.slopes, scratch, now.rates)


@compiled
def _read(arm: Arm, now: Moving, scratch: Scratch, time: float, row: int, out: Pointer, rows: int) -> int:
    """Write the rows within the last step into `out` [J, T', 2]; the row behind them."""
    following = row
    for j in range(arm.joints):
        before, after = shifted(scratch.before, j * STATE), shifted(now.states, j * STATE)
        ends, place = ((before[0], before[1]), (after[0], after[1])), shifted(out, 2 * j * rows)
        following, _ = read_rows(_log(arm, j), row, time, arm.step, ends[0], ends[1], place)
    return following


@compiled
def _sum(values: Pointer, count: int) -> float:
    total = 0.0
    for k in range(count):
        total += values[k]
    return total


def _compile(sources: str) -> tuple[Callable[..., Any], ...]:
    """The kernels; `sources` is part of what numba's cache knows them by."""

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def start(machines: np.ndarray, tables: np.ndarray, first: np.ndarray, states: np.ndarray) -> None:
        sources  # noqa: B018
        none = np.empty(0)
        for j in range(len(machines)):
            machine = machine_at(shifted(pointer(machines), j * _WIDTH))
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
        room: np.ndarray,  # [ROOM·J + J·J] scratch
    ) -> None:
        """Step by step, until all rows are written or a state is no number."""
        sources  # noqa: B018
        joints, rows = command.shape
        rates, mass, bias = np.zeros(joints), np.empty((joints, joints)), np.empty(joints)
        acting = np.zeros((joints, 2), np.int64)
        halfway, place = np.empty(joints), np.empty(joints)
        here = pointer(room)
        slopes, points = here, shifted(here, joints)
        for j in range(joints):
            acting[j, 0], slopes[j] = -1, 0.0
            points[3 * j], points[3 * j + 1], points[3 * j + 2] = first[j, 0], 0.0, math.nan
        before = shifted(points, 3 * joints)
        given = shifted(before, STATE * joints)
        loads = shifted(given, GIVEN * joints)
        found = shifted(loads, joints)
        more = (shifted(found, joints), np.empty((joints, *RESPONSES)), np.empty(0))
        scratch = Scratch(before, given, loads, found, *more)
        arm = Arm(joints, rows, pointer(machines), pointer(command), pointer(times), pointer(first), tables, step)
        now = Moving(acting, points, pointer(states), pointer(rates), slopes, pointer(mass), pointer(bias))
        row, count = 1, 0
        while row < out.shape[1]:
            for j in range(joints):
                halfway[j] = states[j, 1] + 0.5 * step * rates[j]
                place[j] = states[j, 0] + 0.25 * step * (states[j, 1] + halfway[j])
            terms(bodies, place, halfway, mass, bias)
            share = (count * step - times[row - 1]) / (times[row] - times[row - 1])
            at = (row - 1) * parts + min(int(share * parts + ROUNDING), parts - 1)
            _advance(arm, now, scratch, count * step)
            row = _read(arm, now, scratch, count * step, row, pointer(out), out.shape[1])
            for j in range(joints):
                load[at, j] += _load(arm, now, j)
            steps[at] += 1
            count += 1
            if not math.isfinite(_sum(now.states, joints * STATE)):
                break

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def show(machines: np.ndarray, sample_time: float, times: np.ndarray, out: np.ndarray) -> None:
        """What encoders show of the states in `out` [J, T, 2]."""
        sources  # noqa: B018
        for j in range(len(machines)):
            machine = machine_at(shifted(pointer(machines), j * _WIDTH))
            if machine.encoder_quantization_resolution > 0:
                resolution, offset = machine.encoder_quantization_resolution, machine.encoder_quantization_offset
                quantize(out[j], resolution, sample_time, times, offset)

    return start, run, show


start, run, show = _compile(digest(Path(inspect.getfile(rigid))))
