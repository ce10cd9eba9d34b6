"""How a joint's motion changes with torques: of hundreds at once, in little more than the time of one run.

A small torque moves the state, and what moved it is carried on by the tangent of each step: differences of the step's
own function, in state and torques. Such motion is linear in the torques, whatever they are functions of.
"""

import math
from collections.abc import Callable

import numba
import numpy as np

from vision_s2r.joint.clock import Cursor, inputs_of, loaded, read_rows
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import commanded, glides, needs_velocity
from vision_s2r.joint.log import JointLog
from vision_s2r.joint.machine import COLUMNS, JointMachine, continuous, machine_at, of_gains
from vision_s2r.joint.one_mass import Paths, State, middle_velocity, one_mass_sample, one_mass_start
from vision_s2r.joint.pointer import Pointer, pointer, shifted
from vision_s2r.joint.simulation import Prepared, digest, episode_log

NUDGE = 1e-4  # of sizes: as far as a fit goes in the end, so that where a torque jumps its mean slope counts

_WIDTH = len(COLUMNS)
_CARRIED = 6  # position, velocity, weights of static friction and other torque of the last step, low-passed error
_LOAD, _DRIVE, _FACTOR, _MOTOR = range(_CARRIED, _CARRIED + 4)  # torques on the load, of the drive, its factor, others
_DIRECTIONS = _CARRIED + 4


def tangents(given: Prepared, sizes: tuple[float, float, float], drive: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Change [E, T, 2, H + G + F] of position and velocity with torques, about one machine's motion.

    given             of `prepared`: one machine, clocked (it has times), neither play nor spring; its H heights are
                      the first of these torques
    sizes             of positions, velocities and torques: rad, rad/s, N·m (m, m/s, N)
    drive [E, G, T]   what a torque adds to `scale`, the factor of the drive's torque, row by row
    load [E, F, T]    what a torque is on the load, N·m (N), row by row
    """
    episodes, samples = given.command.shape
    heights = given.machines.shape[1] - _WIDTH
    out = np.zeros((episodes, samples, 2, heights + drive.shape[1] + load.shape[1]))
    drive, load = (np.ascontiguousarray(each.transpose(0, 2, 1)) for each in (drive, load))
    room = np.empty(_CARRIED * (2 * _DIRECTIONS + 1) + 2 * _CARRIED * out.shape[3] + 2 * samples)
    position, velocity, torque = sizes
    nudges = NUDGE * np.array([position, velocity, 1.0, 1.0, torque, position, torque, torque, 1.0, torque, 0.0])
    _kernel(given, nudges, drive, load, room, out)
    return out


@compiled
def _after(
    machine: JointMachine,
    tables: np.ndarray,
    heights: np.ndarray,
    log: JointLog,
    cursor: Cursor,
    state: State,
    more: tuple[float, float],  # torque on the load, and factor of the drive's
    at: tuple[float, float],  # where the step begins, and how long it is
    paths: Paths,
    fast: bool,
) -> tuple[State, Cursor]:
    """The state a step later."""
    time, step = at
    acting, cursor = inputs_of(machine, log, cursor, time, step, (state[0], state[1]))
    acting = (acting[0], acting[1], acting[2], acting[3] + more[1], acting[4] + more[0], acting[5])
    state = one_mass_sample(machine, tables, heights, state, (acting, acting), time, (0, 1), (step, step), paths, fast)
    return state, cursor


@compiled
def _nudge(nudges: Pointer, changed: int, of: int) -> float:
    return nudges[of] if changed == of else 0.0


@compiled
def _carry(bend: Pointer, before: Pointer, moved: Pointer, count: int) -> None:
    """Carry on what torques have moved [_CARRIED, D] over a step; most of a step's tangent is nothing."""
    for k in range(_CARRIED):
        after = shifted(moved, k * count)
        for d in range(count):
            after[d] = 0.0
        for j in range(_CARRIED):
            times, of = bend[k * _DIRECTIONS + j], shifted(before, j * count)
            if times != 0:
                for d in range(count):
                    after[d] += times * of[d]


@compiled
def _acts(machine: JointMachine, tables: np.ndarray, direction: int) -> bool:
    """Whether a step depends on this at all: on the last step only where it looks ahead by it."""
    if direction == 2:
        return not math.isnan(machine.stribeck_friction_static)
    if direction == 3:
        return machine.load_dependent_stribeck_coefficient > 0
    if direction == 4:
        return needs_velocity(machine, tables)
    if direction == 5:
        return machine.derivative_on_error_gain > 0
    return direction != _DRIVE or tables[3, 2] > 0


@compiled
def _push(bend: Pointer, direction: int, moved: Pointer, count: int, d: int, much: float) -> None:
    """A torque of this size in the step that is over, of those in one direction."""
    for k in range(_CARRIED):
        moved[k * count + d] += much * bend[k * _DIRECTIONS + direction]


@compiled
def _push_over(
    table: Pointer, first: int, value: float, bend: Pointer, direction: int, moved: Pointer, count: int
) -> int:
    """Torques over a value that is between two knots; behind the last of the table's, the first being `first`."""
    knots = int(table[2])
    if knots > 0:
        place = min(max((value - table[0]) * table[1], 0.0), knots - 1.0)
        left = min(int(place), knots - 2)
        _push(bend, direction, moved, count, first + left, 1 - (place - left))
        _push(bend, direction, moved, count, first + left + 1, place - left)
    return first + knots


@compiled
def _kept(log: JointLog, at: int) -> float:
    """What an observer leaves of an error in the state at a sample."""
    return 1.0 if log.leak == 0 or math.isnan(log.observed[at]) else 1 - log.leak


def _compile(sources: str) -> Callable[..., None]:
    """The kernel; `sources` is part of what numba's cache knows it by."""

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def kernel(
        given: Prepared,
        nudges: np.ndarray,  # [_DIRECTIONS + 1], the last 0
        drive: np.ndarray,  # [E, T, G]
        load: np.ndarray,  # [E, T, F]
        room: np.ndarray,  # scratch
        out: np.ndarray,
    ) -> None:
        sources  # noqa: B018
        tables, heights, none = given.tables, given.machines[0, _WIDTH:], np.empty(0)
        torques, of_drive = out.shape[3], len(heights) + drive.shape[2]
        driven, turned = heights.copy(), heights.copy()
        driven[len(heights) - int(tables[3, 2]) :] += nudges[_DRIVE]
        lone = tables[0, 2] if tables[0, 2] > 0 else tables[1, 2] if tables[1, 2] > 0 else tables[2, 2]
        turned[: int(lone)] += nudges[_MOTOR]
        by, bend = pointer(nudges), pointer(room)
        for d in range(_CARRIED * _DIRECTIONS):  # what does not act stays nothing
            bend[d] = 0.0
        for e in range(len(given.command)):
            moved = shifted(bend, _CARRIED * _DIRECTIONS)
            before = shifted(moved, _CARRIED * torques)
            changed = shifted(before, _CARRIED * torques)
            states = shifted(changed, _CARRIED * (_DIRECTIONS + 1))
            for d in range(_CARRIED * torques):
                moved[d] = 0.0
            machine = of_gains(machine_at(pointer(given.machines)), given.gains[e])
            log = episode_log(given, e, given.substeps)
            step, own, fast = log.sample_time / log.substeps, machine.inertia, not needs_velocity(machine, tables)
            state = one_mass_start(machine, tables, heights, log.first[0], log.first[1])
            paths = glides(machine, 0.5 * step, own, (step, step))
            cursor = (-1, 0, log.first[0], 0.0, math.nan)
            row, shift = read_rows(log, 0, -step, step, log.first, log.first, states)
            count = 0
            while row < log.samples:
                start = (state[0] + shift[0], state[1] + shift[1], state[2], state[3])
                time, here = count * step, cursor
                acting, cursor = inputs_of(machine, log, here, time, step, (start[0], start[1]))
                machine, paths = loaded(machine, own, log, cursor, time, step, paths)
                none_more, both = (0.0, 0.0), (time, step)
                state, _ = _after(machine, tables, heights, log, here, start, none_more, both, paths, fast)
                smooth = continuous(machine)
                for k in range(_DIRECTIONS + 1):
                    if not _acts(machine, tables, k):
                        continue
                    more = _nudge(by, k, _LOAD), _nudge(by, k, _FACTOR)
                    raised = driven if k == _DRIVE else turned if k == _MOTOR else heights
                    weights = start[2][0] + _nudge(by, k, 2), start[2][1] + _nudge(by, k, 3)
                    nudged = (
                        start[0] + _nudge(by, k, 0),
                        start[1] + _nudge(by, k, 1),
                        weights,
                        start[3] + _nudge(by, k, 4),
                    )
                    lagged = (here[0], here[1], here[2], here[3], here[4] + _nudge(by, k, 5))
                    then, later = _after(smooth, tables, raised, log, lagged, nudged, more, both, paths, fast)
                    at = k * _CARRIED
                    changed[at], changed[at + 1], (changed[at + 2], changed[at + 3]), changed[at + 4] = then
                    changed[at + 5] = later[4]
                for k in range(_DIRECTIONS):
                    if not _acts(machine, tables, k):
                        continue
                    for n in range(_CARRIED):
                        change = changed[k * _CARRIED + n] - changed[_DIRECTIONS * _CARRIED + n]
                        bend[n * _DIRECTIONS + k] = 0.0 if math.isnan(change) else change / nudges[k]
                for d in range(_CARRIED * torques):
                    before[d] = moved[d]
                _carry(bend, before, moved, torques)
                middle = start[1]
                if not fast:
                    middle = middle_velocity(machine, tables, heights, start, acting, paths[1], step)
                values = (start[0] + 0.5 * step * middle, middle, time + 0.5 * step)
                behind = 0
                for k in range(3):
                    behind = _push_over(
                        shifted(pointer(tables), 3 * k), behind, values[k], bend, _MOTOR, moved, torques
                    )
                if tables[3, 2] > 0:
                    asked = commanded(machine, tables, none, acting, values[0], middle, middle)
                    root = math.copysign(math.sqrt(abs(asked)), asked)
                    _push_over(shifted(pointer(tables), 9), behind, root, bend, _DRIVE, moved, torques)
                # A row that begins within the step acts for the rest of it.
                now, begins = max(row - 1, 0), min(max((log.times[row] - time) / step, 0.0), 1.0)
                for g in range(drive.shape[2]):
                    much = begins * drive[e, now, g] + (1 - begins) * drive[e, row, g]
                    if much != 0:
                        _push(bend, _FACTOR, moved, torques, len(heights) + g, much)
                for f in range(load.shape[2]):
                    much = begins * load[e, now, f] + (1 - begins) * load[e, row, f]
                    if much != 0:
                        _push(bend, _LOAD, moved, torques, of_drive + f, much)
                ends_of_step = ((start[0], start[1]), (state[0], state[1]))
                following, shift = read_rows(log, row, time, step, ends_of_step[0], ends_of_step[1], states)
                left = (1.0, 1.0)
                for r in range(row, following):
                    x = min(max((log.times[r] - time) / step, 0.0), 1.0)
                    for n in range(2):
                        for d in range(torques):
                            at = n * torques + d
                            out[e, r, n, d] = before[at] + x * (moved[at] - before[at])
                    left = (left[0] * _kept(log, 2 * r), left[1] * _kept(log, 2 * r + 1))
                if log.leak > 0:
                    for d in range(torques):
                        moved[d] *= left[0]
                        moved[torques + d] *= left[1]
                row = following
                count += 1

    return kernel


_kernel = _compile(digest())
