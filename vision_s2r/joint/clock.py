"""Episodes whose joint runs on a clock of its own: position servos, uneven samples, and torques from outside.

The integrator takes steps of one length from the first sample on, whatever the samples do. A command that changes in
a step acts by the mean torque, so that it has the impulse that it should; samples within a step are read off the cubic
through the positions and velocities at its ends. An observer's corrections wait for the end of the step.
"""

import math

import numpy as np

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import NO_LAG, Given, Lag, counted, glides, needs_velocity
from vision_s2r.joint.effects.acceleration_limit import along
from vision_s2r.joint.effects.derivative_on_error import passing
from vision_s2r.joint.effects.velocity_limit import profile
from vision_s2r.joint.log import JointLog, correction
from vision_s2r.joint.machine import JointMachine, of_inertia
from vision_s2r.joint.one_mass import Paths, one_mass_sample, one_mass_start
from vision_s2r.joint.pointer import Pointer
from vision_s2r.joint.two_masses import (
    RESPONSES,
    sprung,
    two_masses_paths,
    two_masses_responses,
    two_masses_sample,
    two_masses_start,
)

ROUNDING = 1e-9  # of a step: a sample no later than this after its end is at its end
HEAVIER = 0.01  # of the inertia: a change that two masses are worked out anew for …
HEAVIER_ONE = 5e-4  # … and that one is

# Row whose command, and part of a row whose other inputs act at the end of the last step; set point and its rate; a
# servo's error as a low pass has it, NaN before its first command.
Cursor = tuple[int, int, float, float, float]


@compiled
def clocked_one_mass(
    machine: JointMachine, tables: np.ndarray, heights: np.ndarray, log: JointLog, out: Pointer
) -> None:
    """An episode of a joint without play or spring, into `out` [T, 2]."""
    step = log.sample_time / log.substeps
    state = one_mass_start(machine, tables, heights, log.first[0], log.first[1])
    paths = glides(machine, 0.5 * step, machine.inertia, (step, step))
    fast = not needs_velocity(machine, tables)
    cursor: Cursor = (-1, 0, log.first[0], 0.0, math.nan)
    row, shift = read_rows(log, 0, -step, step, log.first, log.first, out)
    count, own = 0, machine.inertia
    while row < log.samples:
        state = (state[0] + shift[0], state[1] + shift[1], state[2], state[3])
        before, time = (state[0], state[1]), count * step
        given, cursor = inputs_of(machine, log, cursor, time, step, before)
        machine, paths = loaded(machine, own, log, cursor, time, step, paths)
        state = one_mass_sample(
            machine, tables, heights, state, (given, given), time, (0, 1), (step, step), paths, fast
        )
        row, shift = read_rows(log, row, time, step, before, (state[0], state[1]), out)
        count += 1


@compiled
def loaded(
    machine: JointMachine, own: float, log: JointLog, cursor: Cursor, time: float, step: float, paths: Paths
) -> tuple[JointMachine, Paths]:
    """The machine in the step that ends at the cursor, beside its own inertia that of its load; and its paths."""
    inertia = own + _load_inertia(log, cursor)
    if machine.thermal_drift_rate != 0 or abs(inertia - machine.inertia) > HEAVIER_ONE * machine.inertia:
        machine = of_inertia(machine, inertia)
        paths = glides(machine, time + 0.5 * step, inertia, (step, step))
    return machine, paths


@compiled
def clocked_two_masses(
    machine: JointMachine, tables: np.ndarray, heights: np.ndarray, log: JointLog, out: Pointer
) -> None:
    """An episode of a joint with play or a spring, into `out` [T, 2]."""
    step = log.sample_time / log.substeps
    responses = np.empty(RESPONSES)
    if sprung(machine):
        two_masses_responses(machine, (step, step), responses)
    masses = two_masses_start(machine, tables, heights, log.first[0], log.first[1])
    paths = two_masses_paths(machine, 0.5 * step, (step, step))
    fast = not needs_velocity(machine, tables)
    cursor: Cursor = (-1, 0, log.first[0], 0.0, math.nan)
    row, shift = read_rows(log, 0, -step, step, log.first, log.first, out)
    count, own = 0, machine.inertia
    while row < log.samples:
        (v_motor, v_load, twist, position, side), weight, other = masses
        position, v_load, v_motor = position + shift[0], v_load + shift[1], v_motor + shift[1]
        masses = ((v_motor, v_load, twist, position, side), weight, other)
        before, time = (position, v_load), count * step
        given, cursor = inputs_of(machine, log, cursor, time, step, before)
        inertia = own + _load_inertia(log, cursor)
        changed = abs(inertia - machine.inertia) > HEAVIER * machine.inertia
        if changed:
            machine = of_inertia(machine, inertia)
        if changed and sprung(machine):
            two_masses_responses(machine, (step, step), responses)
        if changed or machine.thermal_drift_rate != 0:
            paths = two_masses_paths(machine, time + 0.5 * step, (step, step))
        masses = two_masses_sample(
            machine, tables, heights, masses, (given, given), time, (0, 1), (step, step), paths, responses, fast
        )
        row, shift = read_rows(log, row, time, step, before, (masses[0][3], masses[0][1]), out)
        count += 1


@compiled
def inputs_of(
    machine: JointMachine, log: JointLog, cursor: Cursor, start: float, step: float, state: tuple[float, float]
) -> tuple[Given, Cursor]:
    """What acts in the step that begins at `start` in this position and velocity, and the cursor at its end."""
    row, other, place, rate, lagged = cursor
    servo = not math.isnan(machine.proportional_gain)
    late = start - machine.latency_delay
    # Before the first command a servo stays where it is, and a motor is given nothing.
    first = log.first[0] if servo else 0.0
    command, later, share, row = _held(log, log.command, 1, row, first, late, step)
    if servo and (machine.velocity_limit_value < math.inf or machine.acceleration_limit_value < math.inf):
        half, place, rate = _set_point(machine, place, rate, command, later, (1 - share) * step, step)
        command, later, share = half, half, 0.0
    lag = NO_LAG
    if machine.derivative_on_error_gain > 0 and row >= 0:
        lag, lagged = _lagged(machine, lagged, command, later, share, state, step)
    scale, external, now = 1.0, 0.0, other
    scaled, pulled, loaded = log.given
    if scaled:
        one, two, part, now = _held(log, log.scale, 1, other // log.parts, log.scale[0], start, step)
        now *= log.parts
        scale = one + part * (two - one)
    if pulled:
        one, two, part, now = _held(log, log.external, log.parts, other, log.external[0], start, step)
        external = one + part * (two - one)
    if loaded and not pulled:
        now = _held(log, log.load_inertia, log.parts, other, log.load_inertia[0], start, step)[3]
    return (command, later, share, scale, external, lag), (row, now, place, rate, lagged)


@compiled
def _lagged(
    machine: JointMachine,
    lagged: float,
    target: float,
    later: float,
    share: float,  # of the step, in which the later target acts
    state: tuple[float, float],
    step: float,
) -> tuple[Lag, float]:
    """What the derivative of a servo's error is taken from in a step, and the error as the low pass has it at its end.

    The mean of a filtered derivative is the filter's change over the step, however short its time constant.
    """
    position = counted(machine, state[0] + 0.5 * step * state[1])
    if math.isnan(lagged):  # as if the first target had been there for long
        target, lagged = later, later - position
    error = target + share * (later - target) - position
    passed = passing(machine.derivative_on_error_time_constant, step)
    return (lagged, machine.derivative_on_error_gain * passed / step), lagged + passed * (error - lagged)


@compiled
def _load_inertia(log: JointLog, cursor: Cursor) -> float:
    """The inertia beside the machine's own, in the step that ends at the cursor."""
    return log.load_inertia[cursor[1]] if log.given[2] else 0.0


@compiled
def _set_point(
    machine: JointMachine, place: float, rate: float, target: float, later: float, change: float, step: float
) -> tuple[float, float, float]:
    """A servo's set point in the middle of a step, and at its end with its rate; the target changes to a later one."""
    fastest, steepest = machine.velocity_limit_value, machine.acceleration_limit_value
    way = profile(place, rate, target, fastest, steepest)
    half = along(way, 0.5 * step)[0]
    if change >= step:
        return half, *along(way, step)
    place, rate = along(way, change)
    way = profile(place, rate, later, fastest, steepest)
    if change < 0.5 * step:
        half = along(way, 0.5 * step - change)[0]
    return half, *along(way, step - change)


@compiled
def _held(
    log: JointLog, values: Pointer, parts: int, row: int, before: float, start: float, step: float
) -> tuple[float, float, float, int]:
    """What is held for each of `parts` of a sample, in the step from `start` on: its mean up to the last change, what
    it is then, for which share of the step, and the row (part of a row) at the end; `row` is that at the start."""
    end, place, total = start + step, start, 0.0
    value = values[row] if row >= 0 else before
    last, sample, part = log.samples * parts - 1, (row + 1) // parts, (row + 1) % parts
    length = _length(log, sample) / parts  # of the part that is next
    begin = log.times[sample] + part * length if row < last else math.inf
    while begin < end - ROUNDING * step:
        change = max(begin, place)
        total += (change - place) * value
        place = change
        row, part = row + 1, part + 1
        value = values[row]
        if part == parts:
            sample, part = sample + 1, 0
            length = _length(log, sample) / parts
        begin = log.times[sample] + part * length if row < last else math.inf
    if place - start <= ROUNDING * step:
        return value, value, 0.0, row
    return total / (place - start), value, (end - place) / step, row


@compiled
def _length(log: JointLog, row: int) -> float:
    """Seconds until the next sample; the last is as long as most."""
    return log.times[row + 1] - log.times[row] if row + 1 < log.samples else log.sample_time


@compiled
def read_rows(
    log: JointLog,
    row: int,
    start: float,
    step: float,
    before: tuple[float, float],  # position and velocity at the start of the step
    after: tuple[float, float],  # and at its end
    out: Pointer,
) -> tuple[int, tuple[float, float]]:
    """Write the rows within a step; the row behind them, and what an observer adds to position and velocity."""
    dx, dv = 0.0, 0.0
    while row < log.samples and log.times[row] <= start + step * (1 + ROUNDING):
        x = min(max((log.times[row] - start) / step, 0.0), 1.0)
        y = 1 - x
        bend = x * y * step * (y * before[1] - x * after[1])
        position = y * y * (1 + 2 * x) * before[0] + x * x * (1 + 2 * y) * after[0] + bend
        velocity = y * before[1] + x * after[1]
        out[2 * row], out[2 * row + 1] = position, velocity
        if log.leak > 0:
            dx += correction(log.leak, log.observed[2 * row], position + dx)
            dv += correction(log.leak, log.observed[2 * row + 1], velocity + dv)
        row += 1
    return row, (dx, dv)
