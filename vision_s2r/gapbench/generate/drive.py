"""The generator's own joint: fourth-order Runge-Kutta of half a millisecond between located events.

Sticking, impacts of the play and changes of the command are events: the step is cut where they happen, so that each
piece is smooth. Nothing is regularized. (Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I, II.6.)
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from vision_s2r.gapbench.generate.compiled import helper

INF = np.inf
# Motor's angle and rate, load's angle and rate, torque of a drive that lags, deflection of a hysteresis, what friction
# remembers, angle and rate of the mount, a servo's error as a filter has it
State = tuple[float, float, float, float, float, float, float, float, float, float]


class DriveModel(NamedTuple):
    """One joint with everything that may act on it, in SI units (N·m, rad, s, A); the defaults act on nothing."""

    torque_constant: float
    inertia: float
    viscous_damping: float
    coulomb_friction: float
    gravity_torque: float = 0.0
    bias_torque: float = 0.0
    # Effects of the vocabulary
    static: float = -1.0  # < 0: no Stribeck friction
    stribeck_velocity: float = 1.0
    load_friction: float = 0.0
    external_friction: float = 0.0
    width: float = 0.0
    limit: float = INF
    stall: float = INF
    no_load_speed: float = INF
    delay: float = 0.0
    resolution: float = 0.0
    cogging: float = 0.0
    teeth: float = 1.0
    thermal_rate: float = 0.0
    viscous_asymmetry: float = 0.0
    coulomb_asymmetry: float = 0.0
    stiffness: float = INF
    spring_damping: float = 0.0
    # Of position servos, whose command is a target (rad); a gain of 0: commands are currents
    proportional_gain: float = 0.0  # A/rad
    derivative_gain: float = 0.0  # A·s/rad, on the load's rate
    command_limit: float = INF  # A
    position_offset: float = 0.0  # rad, that the encoder shows more than there is
    deadband: float = 0.0
    velocity_limit: float = INF
    acceleration_limit: float = INF
    error_rate_gain: float = 0.0  # A·s/rad, on the rate of the error
    error_filter: float = 0.01  # s, that this rate is filtered by
    # Effects outside it (generate.unknown says what each is)
    drag: float = 0.0
    dead_zone: float = 0.0
    spring: float = 0.0
    cubic: float = 0.0
    patch: float = 0.0
    patch_position: float = 0.0
    patch_width: float = 1.0
    disturbance: float = 0.0
    disturbance_frequency: float = 1.0
    disturbance_phase: float = 0.0
    lag: float = 0.0
    switch_time: float = INF
    switch_inertia: float = 0.0
    hysteresis: float = 0.0
    hysteresis_distance: float = 1.0
    bristles: float = 0.0
    bristles_velocity: float = 1.0
    ripple: float = 0.0
    ripple_order: float = 1.0
    fade: float = 0.0
    fade_time: float = 1.0
    detent: float = 0.0
    detent_teeth: float = 1.0
    sag: float = 0.0
    stop: float = INF
    stop_stiffness: float = 0.0
    inertia_swing: float = 0.0
    cable: float = 0.0
    cable_start: float = 0.0
    core: float = 0.0
    cold: float = 0.0
    cold_time: float = 1.0
    mount: float = 0.0
    mount_frequency: float = 1.0
    mount_damping: float = 0.1
    memory: float = 0.0
    memory_time: float = 1.0
    memory_velocity: float = 1.0
    aging: float = 0.0
    aging_distance: float = 1.0
    runout: float = 0.0
    runout_phase: float = 0.0
    brake: float = 0.0
    brake_time: float = 0.0
    film: float = 0.0
    film_time: float = 1.0
    film_velocity: float = 1.0
    driven: float = 0.0


def step_of(drive: DriveModel, longest: float = 5e-4) -> float:
    """A step (s) that resolves the lag of the drive, its filter, and the two halves' oscillation on their spring."""
    if drive.lag > 0:
        longest = min(longest, drive.lag)
    if drive.error_rate_gain > 0:
        longest = min(longest, drive.error_filter / 4)
    if drive.stiffness == INF:
        return longest
    reduced = drive.inertia / 4
    fastest = np.sqrt(drive.stiffness / reduced) + drive.spring_damping / reduced
    return min(longest, 0.2 / fastest)


class PositionLoop(NamedTuple):
    """How commands arise: `gain` 0 plays `command`, else a PD controller tracks `reference` [T, 2] (rad, rad/s)."""

    command: np.ndarray  # [T] A
    reference: np.ndarray  # [T, 2]
    noise: np.ndarray  # [T, 2] what the controller's sensors add
    gain: float = 0.0  # A/rad
    rate_gain: float = 0.0  # A·s/rad
    limit: float = INF  # A


@helper
def _current(y: State, command: float, p: DriveModel) -> float:
    """What a servo asks of its motor, A, whose command is a set point (rad); else the command itself."""
    if p.proportional_gain == 0:
        return command
    error = _error(y, command, p)
    wanted = p.error_rate_gain * (error - y[9]) / p.error_filter if p.error_rate_gain > 0 else 0.0
    if p.deadband > 0:
        if abs(error) <= p.deadband / 2:
            return 0.0
        error -= np.sign(error) * p.deadband / 2
    wanted += p.proportional_gain * error - p.derivative_gain * y[3]
    return min(max(wanted, -p.command_limit), p.command_limit)


@helper
def _error(y: State, point: float, p: DriveModel) -> float:
    """How far a servo's encoder is short of its set point, rad."""
    shown = y[2]
    if p.resolution > 0:
        shown = np.round(shown / p.resolution) * p.resolution
    return point - shown


@helper
def _motor_torque(t: float, y: State, command: float, p: DriveModel) -> float:
    """Torque of the motor after its limits, N·m."""
    torque = y[4] if p.lag > 0 else p.torque_constant * _current(y, command, p)
    if p.core > 0:
        torque /= 1 + p.core * abs(torque)
    if p.fade > 0:
        torque *= 1 - p.fade * (1 - np.exp(-t / p.fade_time))
    if p.ripple > 0:
        torque *= 1 + p.ripple * np.sin(p.ripple_order * y[0])
    if p.sag > 0:
        torque /= 1 + p.sag * max(torque * y[1], 0.0)
    if p.dead_zone > 0:
        torque = np.sign(torque) * max(abs(torque) - p.dead_zone, 0.0)
    torque = min(max(torque, -p.limit), p.limit)
    if p.stall < INF:
        upper = p.stall * min(max(1 - y[1] / p.no_load_speed, 0.0), 1.0)
        lower = -p.stall * min(max(1 + y[1] / p.no_load_speed, 0.0), 1.0)
        torque = min(max(torque, lower), upper)
    return torque


@helper
def _on_load(y: State, p: DriveModel) -> float:
    """Torque on the load's side, N·m."""
    over = max(y[2] - p.stop, 0.0) - max(-y[2] - p.stop, 0.0)
    spring = p.spring * y[2] + p.cubic * y[2] ** 3 + p.stop_stiffness * over
    if p.cable > 0:
        spring += p.cable * max(y[2] - p.cable_start, 0.0)
    gravity = p.gravity_torque * np.sin(y[2] - p.position_offset) if p.gravity_torque != 0 else 0.0
    return -gravity - p.bias_torque - spring


@helper
def _dry_friction(t: float, y: State, direction: float, torque: float, p: DriveModel) -> float:
    """Size of the dry friction against motion in this direction, N·m."""
    level = p.coulomb_friction
    if p.static >= 0:
        level += (p.static - p.coulomb_friction) * np.exp(-((y[1] / p.stribeck_velocity) ** 2))
    if p.patch > 0:
        angle = (y[0] - p.patch_position + np.pi) % (2 * np.pi) - np.pi
        level += p.patch * np.exp(-((angle / p.patch_width) ** 2))
    if p.cold > 0:
        level *= 1 + p.cold * np.exp(-t / p.cold_time)
    if p.memory > 0:
        level += p.memory * np.exp(-((y[6] / p.memory_velocity) ** 2))
    if p.aging > 0:
        level += p.aging * np.log1p(y[6])
    if p.film > 0:
        level += p.film * y[6]
    if direction * torque < 0:
        level *= 1 - p.driven
    if p.runout > 0:
        level *= 1 + p.runout * np.sin(y[0] + p.runout_phase)
    if t < p.brake_time:
        level += p.brake
    pressed = p.load_friction * torque
    if p.external_friction > 0:
        pressed -= p.external_friction * _on_load(y, p)
    return max(level + abs(pressed) + direction * p.coulomb_asymmetry, 0.0)


@helper
def _on_motor(t: float, y: State, direction: float, torque: float, p: DriveModel) -> float:
    """Every other torque on the motor's side but dry friction, N·m."""
    damping = p.viscous_damping * (1 + p.thermal_rate * t) + direction * p.viscous_asymmetry
    total = torque - damping * y[1] - p.drag * y[1] * abs(y[1]) - p.hysteresis * y[5]
    if p.cogging > 0:
        total += p.cogging * np.sin(p.teeth * y[0])
    if p.detent > 0:
        total += p.detent * (np.sin(p.detent_teeth * y[0]) + np.sin(2 * p.detent_teeth * y[0] + 1.0))
    if p.disturbance > 0:
        total += p.disturbance * np.sin(2 * np.pi * p.disturbance_frequency * t + p.disturbance_phase)
    return total


@helper
def _inertia(t: float, y: State, p: DriveModel) -> float:
    inertia = p.inertia + (p.switch_inertia if t >= p.switch_time else 0.0)
    return inertia * (1 + p.inertia_swing * np.sin(2 * y[0])) if p.inertia_swing != 0 else inertia


@helper
def _slope(t: float, y: State, current: float, direction: float, side: int, p: DriveModel) -> State:
    """Time derivative of the state; `direction` 0: the motor sticks; `side` 2: one mass, ±1: in contact, 0: apart."""
    torque = _motor_torque(t, y, current, p)
    motor = _on_motor(t, y, direction, torque, p) - direction * _dry_friction(t, y, direction, torque, p)
    load = _on_load(y, p)
    inertia = _inertia(t, y, p)
    if side != 0:
        swing = p.inertia * p.inertia_swing * np.cos(2 * y[0]) * y[1] ** 2 if p.inertia_swing != 0 else 0.0
        motor_rate = 0.0 if direction == 0 else (motor + load - swing) / inertia
        load_rate = motor_rate
    else:
        if p.width == 0:
            spring = p.stiffness * (y[0] - y[2]) + p.spring_damping * (y[1] - y[3])
            motor -= spring
            load += spring
        motor_rate = 0.0 if direction == 0 else 2 * motor / inertia
        load_rate = 2 * load / inertia
    drive_rate = (p.torque_constant * _current(y, current, p) - y[4]) / p.lag if p.lag > 0 else 0.0
    mount_rate = 0.0
    if p.mount > 0:  # what moves is relative to what it is mounted on
        mount_rate = _mount(y, motor if direction != 0 else 0.0, p)
        motor_rate -= mount_rate if direction != 0 else 0.0
        load_rate -= mount_rate if side == 0 or direction != 0 else 0.0
    bent = (y[1] - abs(y[1]) * y[5] / _bristles(y, p)) / p.hysteresis_distance
    filtered = (_error(y, current, p) - y[9]) / p.error_filter if p.error_rate_gain > 0 else 0.0
    return y[1], motor_rate, y[3], load_rate, drive_rate, bent, _remembered(y, p), y[8], mount_rate, filtered


@helper
def _bristles(y: State, p: DriveModel) -> float:
    """How far bristles bend before they slip, over how far where they are fast: the slower, the farther."""
    return 1 + p.bristles * np.exp(-((y[1] / p.bristles_velocity) ** 2)) if p.bristles > 0 else 1.0


@helper
def _mount(y: State, reaction: float, p: DriveModel) -> float:
    """Acceleration of what the joint is mounted on, which this torque of the motor pushes back, rad/s²."""
    frequency = p.mount_frequency
    return -(frequency**2) * y[7] - 2 * p.mount_damping * frequency * y[8] - p.mount * reaction / p.inertia


@helper
def _remembered(y: State, p: DriveModel) -> float:
    """How what friction remembers changes: a velocity that lags, a film's lack, the contact's age over 0.1 s."""
    if p.memory > 0:
        return (y[1] - y[6]) / p.memory_time
    if p.film > 0:
        return (np.exp(-((y[1] / p.film_velocity) ** 2)) - y[6]) / p.film_time
    return 10.0 - abs(y[1]) * y[6] / p.aging_distance if p.aging > 0 else 0.0


@helper
def _plus(y: State, h: float, k: State) -> State:
    return (
        *(y[0] + h * k[0], y[1] + h * k[1], y[2] + h * k[2]),
        *(y[3] + h * k[3], y[4] + h * k[4], y[5] + h * k[5]),
        *(y[6] + h * k[6], y[7] + h * k[7], y[8] + h * k[8], y[9] + h * k[9]),
    )


@helper
def _runge_kutta(t: float, y: State, h: float, current: float, direction: float, side: int, p: DriveModel) -> State:
    k1 = _slope(t, y, current, direction, side, p)
    k2 = _slope(t + h / 2, _plus(y, h / 2, k1), current, direction, side, p)
    k3 = _slope(t + h / 2, _plus(y, h / 2, k2), current, direction, side, p)
    k4 = _slope(t + h, _plus(y, h, k3), current, direction, side, p)
    return _plus(_plus(_plus(_plus(y, h / 6, k1), h / 3, k2), h / 3, k3), h / 6, k4)


@helper
def _breakaway(t: float, y: State, current: float, side: int, p: DriveModel) -> float:
    """Direction in which a motor at rest starts to move, 0: friction holds it."""
    torque = _motor_torque(t, y, current, p)
    net = _on_motor(t, y, 0.0, torque, p)
    if side != 0:
        net += _on_load(y, p)
    elif p.width == 0:
        net -= p.stiffness * (y[0] - y[2]) + p.spring_damping * (y[1] - y[3])
    if p.mount > 0:
        net -= (p.inertia if side != 0 else p.inertia / 2) * _mount(y, 0.0, p)
    direction = np.sign(net)
    return direction if abs(net) > _dry_friction(t, y, direction, torque, p) else 0.0


@helper
def _reversed(y: State, direction: float) -> bool:
    return direction != 0 and direction * y[1] < 0


@helper
def _put(y: State, motor: float, motor_rate: float, load: float, load_rate: float) -> State:
    """The state with motor and load elsewhere."""
    return motor, motor_rate, load, load_rate, y[4], y[5], y[6], y[7], y[8], y[9]


@helper
def _touching(y: State, side: int, p: DriveModel) -> bool:
    return side == 0 and p.width > 0 and abs(y[0] - y[2]) > p.width / 2


@helper
def advance(
    t: float, y: State, h: float, current: float, direction: float, side: int, p: DriveModel
) -> tuple[State, float, int]:
    """The state after h seconds of constant command, cut at each event; with the direction and the side of contact."""
    for _ in range(100):
        if direction == 0:
            direction = _breakaway(t, y, current, side, p)
        if abs(side) == 1:  # a contact can push, not pull
            slope = _slope(t, y, current, direction, side, p)
            push = p.inertia / 2 * (slope[3] + slope[8]) - _on_load(y, p)
            if side * push < -1e-12:
                side = 0
                if direction == 0:
                    direction = _breakaway(t, y, current, side, p)
        after = _runge_kutta(t, y, h, current, direction, side, p)
        if not (_reversed(after, direction) or _touching(after, side, p)):
            return after, direction, side
        low, high = 0.0, h
        while high - low > 1e-10:
            middle = (low + high) / 2
            after = _runge_kutta(t, y, middle, current, direction, side, p)
            if _reversed(after, direction) or _touching(after, side, p):
                high = middle
            else:
                low = middle
        y = _runge_kutta(t, y, high, current, direction, side, p)
        t += high
        h -= high
        if _touching(y, side, p):
            side = 1 if y[0] > y[2] else -1
            speed = (y[1] + y[3]) / 2
            y = _put(y, y[0], speed, y[0] - side * p.width / 2, speed)
            direction = np.sign(speed)
        else:
            direction = 0.0
            y = _put(y, y[0], 0.0, y[2], 0.0 if side != 0 else y[3])
        if h <= 1e-10:
            break
    return y, direction, side


@helper
def started(p: DriveModel, first: np.ndarray) -> tuple[State, float, int]:
    """A joint at this position and velocity [2], whose halves do not touch: state, direction, and side of contact."""
    y = (first[0], first[1], first[0], first[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return y, np.sign(first[1]), 0 if p.width > 0 or p.stiffness < INF else 2


@helper
def _command(k: int, shown: np.ndarray, loop: PositionLoop) -> float:
    """What the controller commands at sample k, A."""
    if loop.gain == 0:
        return loop.command[k]
    error = loop.reference[k] - shown - loop.noise[k]
    return min(max(loop.gain * error[0] + loop.rate_gain * error[1], -loop.limit), loop.limit)


@njit(cache=True, nogil=True)
def run(
    p: DriveModel, loop: PositionLoop, first: np.ndarray, sample_time: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Free run from `first` (rad, rad/s): the load's position and velocity [T, 2], and the commands [T] (A).

    Row k is the state at k · sample_time, before command k acts; no sensor is between.
    """
    samples = len(loop.command)
    rows = np.empty((samples, 2))
    command = np.zeros(samples)
    y, direction, side = started(p, first)
    late = int(p.delay / sample_time)
    fraction = p.delay - late * sample_time
    for k in range(samples):
        rows[k, 0], rows[k, 1] = y[2], y[3]
        shown = rows[k].copy()
        if p.resolution > 0:
            shown[0] = np.round(shown[0] / p.resolution) * p.resolution
        command[k] = _command(k, shown, loop)
        pieces = ((k - late - 1, fraction), (k - late, sample_time - fraction))
        t = k * sample_time
        for sent, duration in pieces:
            if duration < 1e-10:
                continue
            current = command[sent] if sent >= 0 else 0.0
            steps = int(np.ceil(duration / step))
            for _ in range(steps):
                y, direction, side = advance(t, y, duration / steps, current, direction, side, p)
                t += duration / steps
    return rows, command
