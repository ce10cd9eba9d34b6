"""Joint effects outside the vocabulary, in two lists that share no kind: one to tune on, one to report on."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from vision_s2r.gapbench.generate.drive import DriveModel
from vision_s2r.gapbench.generate.excitation import SAMPLE_TIME
from vision_s2r.gapbench.generate.library import Draw, Family, Fields, Scale

Alter = Callable[[float, np.random.Generator], Callable[[np.ndarray], np.ndarray]]


def _quadratic_drag(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"drag": x * scale.torque / scale.speed**2}


def _dead_zone(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"dead_zone": 0.4 * x * scale.torque}


def _cubic_spring(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"cubic": x * scale.torque / max(scale.range, 1.0) ** 3}


def _return_spring(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"spring": x * scale.torque / max(scale.range, 1.0)}


def _friction_patch(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    place, width = rng.uniform(-0.5, 0.5), rng.uniform(0.1, 0.5)
    return lambda x: {"patch": 0.5 * x * scale.torque, "patch_position": place, "patch_width": width}


def _disturbance(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    frequency, phase = rng.uniform(0.3, 3.0), rng.uniform(0, 2 * np.pi)
    return lambda x: {
        "disturbance": 0.4 * x * scale.torque,
        "disturbance_frequency": frequency,
        "disturbance_phase": phase,
    }


def _current_lag(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"lag": max(0.1 * x, 2e-4)}


def _load_switch(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    time = rng.uniform(2.0, 6.0)
    return lambda x: {"switch_inertia": 2 * x * nominal.inertia, "switch_time": time}


def _hysteresis(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    distance = rng.uniform(0.1, 0.5)
    return lambda x: {"hysteresis": 0.4 * x * scale.torque, "hysteresis_distance": distance}


def _bristles(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """Surfaces touch by bristles, which bend before they slip (LuGre, Canudas de Wit et al. 1995)."""
    distance, more, velocity = rng.uniform(0.01, 0.05), rng.uniform(0.5, 1.5), rng.uniform(0.2, 0.6)
    return lambda x: {
        "hysteresis": 0.4 * x * scale.torque,
        "hysteresis_distance": distance,
        "bristles": more,
        "bristles_velocity": velocity,
    }


def _ripple(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    order = float(rng.integers(3, 13))
    return lambda x: {"ripple": 0.8 * x, "ripple_order": order}


def _fade(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    time = rng.uniform(1.0, 4.0)
    return lambda x: {"fade": 0.6 * x, "fade_time": time}


def _detent(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    teeth = float(rng.integers(3, 9))
    return lambda x: {"detent": 0.3 * x * scale.torque, "detent_teeth": teeth}


def _sag(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"sag": 3 * x / (scale.torque * scale.speed)}


def _inertia_swing(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    sign = rng.choice([-1.0, 1.0])
    return lambda x: {"inertia_swing": 0.8 * sign * x}


def _end_stop(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    stiffness = rng.uniform(2.0, 8.0) * scale.torque
    return lambda x: {"stop": scale.range * (1 - 0.9 * x), "stop_stiffness": stiffness}


def _cable(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A cable that pulls once it is taut."""
    start = rng.uniform(-0.3, 0.3) * scale.range
    return lambda x: {"cable": 2 * x * scale.torque / max(scale.range, 1.0), "cable_start": start}


def _mount(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """What the joint is mounted on gives, and rings when the motor pushes it back."""
    frequency, damping = rng.uniform(20.0, 60.0), rng.uniform(0.03, 0.15)
    return lambda x: {"mount": x, "mount_frequency": frequency, "mount_damping": damping}


def _core(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """The motor's iron saturates: each ampere more gives less torque."""
    return lambda x: {"core": 2 * x / scale.torque}


def _cold(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """Dry friction of a cold gear, which warms up."""
    time = rng.uniform(1.0, 4.0)
    return lambda x: {"cold": 4 * x, "cold_time": time}


def _friction_memory(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A lubricant's film builds up and breaks down late (Hess and Soom 1990)."""
    time, velocity = rng.uniform(0.05, 0.2), rng.uniform(0.2, 0.6)
    return lambda x: {"memory": 0.4 * x * scale.torque, "memory_time": time, "memory_velocity": velocity}


def _aging(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A contact grows stronger the longer it rests (rate and state, Dieterich 1979)."""
    distance = rng.uniform(0.05, 0.3)
    return lambda x: {"aging": 0.2 * x * scale.torque, "aging_distance": distance}


def _film(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A film is squeezed out where the joint is slow, and drawn in where it is fast, and either takes its time."""
    time, velocity = rng.uniform(0.05, 0.5), rng.uniform(0.1, 0.6)
    return lambda x: {"film": 0.4 * x * scale.torque, "film_time": time, "film_velocity": velocity}


def _driven(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A gear rubs less where the load drives the motor."""
    return lambda x: {"driven": 0.95 * x}


def _runout(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A gear off its centre: dry friction comes and goes once a turn."""
    phase = rng.uniform(0, 2 * np.pi)
    return lambda x: {"runout": 0.95 * x, "runout_phase": phase}


def _brake(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    """A holding brake is let go too late."""
    time = rng.uniform(1.0, 4.0)
    return lambda x: {"brake": 0.5 * x * scale.torque, "brake_time": time}


def _nothing(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    def family(x: float) -> Fields:
        return {}

    return family


def _kept(values: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """Values [T, …], in place of those that are lost [T] the last that is not; the first never is."""
    return values[np.maximum.accumulate(np.where(lost, 0, np.arange(len(values))))]


def _late(shown: np.ndarray, delay: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Readings [T, 2] as they were a delay (s) before, which depends on the time (s) since the episode began."""
    t = np.arange(len(shown)) * SAMPLE_TIME
    return np.stack([np.interp(t - delay(t), t, column) for column in shown.T], axis=1)


def _runs(count: int, often: float, lengths: tuple[int, int], seed: int) -> np.ndarray:
    """Whether samples [count] are in a run; such a share of samples begins one, of a length that is drawn once."""
    each = np.random.default_rng(seed)
    begun = each.random(count) < often
    return np.asarray(np.convolve(begun, np.ones(int(each.integers(*lengths))))[:count] > 0)


def _slew(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The drive follows its command [T] at a limited rate, here in shares of the command's range a sample."""

    def alter(command: np.ndarray) -> np.ndarray:
        most = np.ptp(command) * 0.01 / x
        given = np.zeros_like(command)
        last = 0.0
        for k, wanted in enumerate(command):
            last += np.clip(wanted - last, -most, most)
            given[k] = last
        return given

    return alter


def _dropped(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """Commands get lost at random: the drive keeps the last one."""
    seed = int(rng.integers(2**31))

    def alter(command: np.ndarray) -> np.ndarray:
        return _kept(command, np.random.default_rng(seed).random(len(command)) < 0.8 * x)

    return alter


def _eccentric(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The encoder's disc sits off its centre: an error of once a turn, on position and rate [T, 2]."""
    phase = rng.uniform(0, 2 * np.pi)

    def alter(shown: np.ndarray) -> np.ndarray:
        angle = shown[:, 0] + phase
        offset = 0.3 * x * (np.sin(angle) - np.sin(phase))
        return np.stack([shown[:, 0] + offset, shown[:, 1] * (1 + 0.3 * x * np.cos(angle))], axis=1)

    return alter


def _late_sensor(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The sensor's delay grows from nothing over the episode."""

    def alter(shown: np.ndarray) -> np.ndarray:
        return _late(shown, lambda t: 0.1 * x * t / t[-1])

    return alter


def _wandering_sensor(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The sensor's delay swells and shrinks, as that of a bus that others use."""
    period, phase = rng.uniform(2.0, 6.0), rng.uniform(0, 2 * np.pi)

    def alter(shown: np.ndarray) -> np.ndarray:
        return _late(shown, lambda t: 0.05 * x * (1 + np.sin(2 * np.pi * t / period + phase)))

    return alter


def _lost_readings(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """Readings [T, 2] get lost in runs: the log has the last one."""
    seed = int(rng.integers(2**31))

    def alter(shown: np.ndarray) -> np.ndarray:
        return _kept(shown, _runs(len(shown), 0.1 * x, (2, 8), seed))

    return alter


def _interpolation(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """An encoder interpolates badly between its lines: an error of each line's width, on position and rate [T, 2]."""
    lines = float(rng.integers(24, 65))

    def alter(shown: np.ndarray) -> np.ndarray:
        angle = lines * shown[:, 0]
        return np.stack(
            [shown[:, 0] + 0.3 * x * np.sin(angle) / lines, shown[:, 1] * (1 + 0.3 * x * np.cos(angle))], axis=1
        )

    return alter


def _coarse(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The drive knows few currents: commands [T] are rounded, to as little as five."""

    def alter(command: np.ndarray) -> np.ndarray:
        step = 0.25 * x * np.ptp(command)
        return np.round(command / step) * step

    return alter


def _one_sided(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """One half of the drive's bridge is weaker: commands [T] of one sign give less."""
    sign = rng.choice([-1.0, 1.0])

    def alter(command: np.ndarray) -> np.ndarray:
        return np.where(sign * command > 0, (1 - 0.6 * x) * command, command)

    return alter


def _knocks(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The joint is knocked now and then: torques of a few samples beside the commands [T]."""
    seed = int(rng.integers(2**31))

    def alter(command: np.ndarray) -> np.ndarray:
        each = np.random.default_rng(seed)
        knocks = np.where(each.random(len(command)) < 0.02, each.normal(size=len(command)), 0.0)
        return command + 2 * x * np.ptp(command) * np.convolve(knocks, np.ones(3))[: len(command)]

    return alter


def _slow_drive(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """The drive takes a command only every so often, and holds it."""

    def alter(command: np.ndarray) -> np.ndarray:
        every = 2 + round(14 * x)
        return command[np.arange(len(command)) // every * every]

    return alter


def _loose_contact(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """A contact opens for tens of milliseconds, in which the drive gives nothing."""
    seed = int(rng.integers(2**31))

    def alter(command: np.ndarray) -> np.ndarray:
        return np.where(_runs(len(command), 0.06 * x, (3, 12), seed), 0.0, command)

    return alter


def _uneven_scale(x: float, rng: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
    """An encoder's scale is uneven: errors of a few periods a turn, on position and rate [T, 2]."""
    orders = rng.choice(np.arange(4, 16), 3, replace=False).astype(float)
    phases = rng.uniform(0, 2 * np.pi, 3)

    def alter(shown: np.ndarray) -> np.ndarray:
        angle = orders * shown[:, :1] + phases
        offset = 0.2 * x * ((np.sin(angle) - np.sin(phases)) / orders).sum(axis=1)
        return np.stack([shown[:, 0] + offset, shown[:, 1] * (1 + 0.2 * x * np.cos(angle).sum(axis=1))], axis=1)

    return alter


@dataclass(frozen=True)
class UnknownEffect:
    """An effect outside the vocabulary.

    `command` alters what the drive is told, `sensor` what is read; `optional` are effects of the vocabulary that are
    part of it, so that naming them is not wrong.
    """

    draw: Draw = _nothing
    command: Alter | None = None
    sensor: Alter | None = None
    optional: tuple[str, ...] = field(default=())


UNKNOWN: dict[str, dict[str, UnknownEffect]] = {
    "tuning": {
        "quadratic_drag": UnknownEffect(_quadratic_drag),
        "dead_zone": UnknownEffect(_dead_zone),
        "cubic_spring": UnknownEffect(_cubic_spring),
        "return_spring": UnknownEffect(_return_spring),
        "friction_patch": UnknownEffect(_friction_patch),
        "periodic_disturbance": UnknownEffect(_disturbance),
        "current_lag": UnknownEffect(_current_lag),
        "load_switch": UnknownEffect(_load_switch),
        "rate_limiter": UnknownEffect(command=_slew),
        "cable_pull": UnknownEffect(_cable),
        "mount_resonance": UnknownEffect(_mount),
        "torque_constant_saturation": UnknownEffect(_core),
        "friction_that_warms_up": UnknownEffect(_cold),
        "knocks": UnknownEffect(command=_knocks),
        "slow_drive": UnknownEffect(command=_slow_drive),
        "loose_contact": UnknownEffect(command=_loose_contact),
        "uneven_scale": UnknownEffect(sensor=_uneven_scale),
        "bristles": UnknownEffect(_bristles),
        "wandering_sensor_delay": UnknownEffect(sensor=_wandering_sensor),
        "lost_readings": UnknownEffect(sensor=_lost_readings),
        "squeezed_film": UnknownEffect(_film),
        "friction_of_a_driven_gear": UnknownEffect(_driven),
    },
    "reporting": {
        "hysteresis": UnknownEffect(_hysteresis),
        "torque_ripple": UnknownEffect(_ripple),
        "torque_constant_fade": UnknownEffect(_fade),
        "two_harmonic_detent": UnknownEffect(_detent, optional=("cogging",)),
        "supply_sag": UnknownEffect(_sag),
        "end_stop": UnknownEffect(_end_stop),
        "position_dependent_inertia": UnknownEffect(_inertia_swing),
        "dropped_commands": UnknownEffect(command=_dropped),
        "encoder_eccentricity": UnknownEffect(sensor=_eccentric),
        "growing_sensor_delay": UnknownEffect(sensor=_late_sensor),
        "friction_memory": UnknownEffect(_friction_memory),
        "contact_aging": UnknownEffect(_aging),
        "gear_runout": UnknownEffect(_runout),
        "late_brake": UnknownEffect(_brake),
        "encoder_interpolation": UnknownEffect(sensor=_interpolation),
        "coarse_commands": UnknownEffect(command=_coarse),
        "one_sided_drive": UnknownEffect(command=_one_sided),
    },
}
