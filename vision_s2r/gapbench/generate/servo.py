"""Generated position servos: logs of targets and positions at 25, 50 and 200 Hz, with or without a speed register.

Rows jitter and some are missing; nulls are logged at 1 kHz too, evenly. Of three logs one has a speed register that
lags by 18 to 20 ms, as hobby servos' do, one a velocity as it is, and one none. An effect shows when it moves the free
run's position by 3 to 300 times the noise of the encoder, everything else equal, and is distinct: at least once the
noise remains when nominal values and gains are refitted to imitate it (to first order).
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vision_s2r.gapbench.generate import servo_motion
from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine, Redraw, drawn
from vision_s2r.gapbench.generate.drive import DriveModel, step_of
from vision_s2r.gapbench.generate.library import LIBRARY, Family, KnownEffect, Scale, compatible
from vision_s2r.gapbench.generate.servo_motion import ServoEpisode
from vision_s2r.gapbench.generate.servo_run import run_servo
from vision_s2r.gapbench.generate.severity import left_over, of_severity
from vision_s2r.gapbench.generate.truth import COARSE, FINE
from vision_s2r.gapbench.generate.unknown import UNKNOWN

CASES = ("null", "single", "pair", "unknown")
RATES = (25, 50, 200)  # Hz
NULL_RATES = (*RATES, 1000)
VELOCITIES = ("lagging", "none", "true")  # of the velocity column
LAG = (0.018, 0.020)  # s
MILD, SEVERE = 3.0, 300.0  # in units of the encoder's noise
DISTINCT = 1.0
NOTICEABLE = 1.05  # a factor from which a wrong value is to be named
BELIEVED = ("inertia", "viscous_damping", "coulomb_friction", "gravity_torque", "bias_torque")
GAINS = ("proportional_gain", "derivative_gain")


def _gain(field: str) -> Callable[[DriveModel, Scale, np.random.Generator], Family]:
    def draw(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
        """A wrong value, up to twice or half the nominal one."""
        sign = rng.choice([-1.0, 1.0])
        return lambda x: {field: getattr(nominal, field) * 2.0 ** (sign * x)}

    return draw


def _offset(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    sign = rng.choice([-1.0, 1.0])
    return lambda x: {"position_offset": 0.6 * sign * x}


def _deadband(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"deadband": 0.1 * x}


def _velocity_limit(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"velocity_limit": 0.4 * scale.speed / x}


def _acceleration_limit(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    fastest = nominal.torque_constant * nominal.command_limit / nominal.inertia  # rad/s²
    return lambda x: {"acceleration_limit": 0.1 * fastest / x}


def _error_rate(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    time = float(np.exp(rng.uniform(np.log(0.004), np.log(0.03))))
    damping = (nominal.viscous_damping / nominal.torque_constant) + nominal.derivative_gain
    return lambda x: {"error_rate_gain": damping * x, "error_filter": time}


def _external_friction(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"external_friction": 0.5 * x if nominal.gravity_torque else 0.0}


OF_SERVOS = {
    "proportional_gain": KnownEffect(_gain("proportional_gain"), {"value": "proportional_gain"}, (), "dynamics"),
    "derivative_gain": KnownEffect(_gain("derivative_gain"), {"value": "derivative_gain"}, (), "dynamics"),
    "position_offset": KnownEffect(_offset, {"value": "position_offset"}, (), "dynamics"),
    "deadband": KnownEffect(_deadband, {"width": "deadband"}),
    "velocity_limit": KnownEffect(_velocity_limit, {"value": "velocity_limit"}),
    "acceleration_limit": KnownEffect(_acceleration_limit, {"value": "acceleration_limit"}),
    "derivative_on_error": KnownEffect(_error_rate, {"gain": "error_rate_gain", "time_constant": "error_filter"}),
}
UNDER_WEIGHT = {"external_load_friction": KnownEffect(_external_friction, {"coefficient": "external_friction"})}
# A torque constant is one with the gains; what servos alone have goes first.
SERVO_LIBRARY = OF_SERVOS | UNDER_WEIGHT | {name: LIBRARY[name] for name in LIBRARY if name != "torque_constant"}
LEAST = {"velocity_limit": 0.13, "acceleration_limit": 0.1}  # intensities: no limits beyond what the servo can do
_SETTERS = [{"velocity_limit", "acceleration_limit"}, {"position_offset", "bias_torque"}]


@dataclass(frozen=True)
class ServoSetting:
    """What the simulator believes, how the servo is told to move, and the noise of its sensors (rad, rad/s)."""

    nominal: DriveModel
    episodes: list[ServoEpisode]
    noise: tuple[float, float]
    scale: Scale
    rate: int

    def motion(self, drive: DriveModel, longest: float = COARSE) -> list[np.ndarray]:
        """Of a drive: position and velocity [T, 2] of each episode, without sensors."""
        step = step_of(drive, longest)
        return [run_servo(drive, each.targets, each.times, each.targets[0], step) for each in self.episodes]

    def positions(self, drive: DriveModel) -> np.ndarray:
        """Positions of all episodes [N] (rad)."""
        return np.concatenate([encoded(rows[:, 0], drive.resolution) for rows in self.motion(drive)])

    def severity(self, drive: DriveModel, without: DriveModel) -> float:
        """How far apart two servos move, in units of the encoder's noise."""
        apart = self.positions(drive) - self.positions(without)
        return float(np.sqrt(np.mean(apart**2))) / self.noise[0]


def encoded(position: np.ndarray, resolution: float) -> np.ndarray:
    """Positions through an encoder of this resolution (rad); 0: as they are."""
    return position if resolution == 0 else np.round(position / resolution) * resolution


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """Draw one servo of a case; see `generate.base`. Rates, velocity columns and effects are taken in turn."""
    rates = NULL_RATES if case == "null" else RATES
    rate, velocity = rates[index % len(rates)], VELOCITIES[(index // len(rates)) % len(VELOCITIES)]

    def draw() -> GeneratedMachine:
        setting = _setting(rate, rng)
        drive, answer = _DRAWN[case](setting, index, split, rng)
        return _recorded(setting, drive, answer, velocity, rng)

    return drawn(draw, f"servo of case '{case}' number {index}")


def _setting(rate: int, rng: np.random.Generator) -> ServoSetting:
    """A hobby servo's size and law, and what it is told."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    inertia, bandwidth, reach = between(0.005, 0.05), between(12.0, 30.0), between(0.4, 1.0)
    gain = inertia * bandwidth**2
    damping = 2 * rng.uniform(0.5, 1.1) * bandwidth * inertia
    electric = rng.uniform(0.2, 0.6) if rng.random() < 0.5 else 0.0  # part of the damping that is the law's
    limit = gain * reach * rng.uniform(0.3, 0.9)
    constant = between(0.5, 2.0)
    nominal = DriveModel(
        torque_constant=constant,
        inertia=inertia,
        viscous_damping=damping * (1 - electric),
        coulomb_friction=limit * rng.uniform(0.01, 0.06),
        gravity_torque=limit * rng.uniform(0.1, 0.3) if rng.random() < 0.5 else 0.0,
        bias_torque=rng.choice([-1.0, 1.0]) * limit * rng.uniform(0.02, 0.06) if rng.random() < 0.2 else 0.0,
        proportional_gain=gain / constant,
        derivative_gain=damping * electric / constant,
        command_limit=limit / constant,
    )
    finite = {name: float(f"{value:.4g}") for name, value in nominal._asdict().items() if np.isfinite(value)}
    nominal = nominal._replace(**finite)
    episodes = servo_motion.draw(rate, reach, bandwidth, rng)
    setting = ServoSetting(nominal, episodes, (between(1e-4, 4e-4), between(5e-3, 3e-2)), Scale(1.0, 1.0, 1.0), rate)
    rows = np.concatenate(setting.motion(nominal))
    peaks = np.abs(rows).max(axis=0)
    return replace(setting, scale=Scale(torque=limit, speed=float(peaks[1]), range=float(peaks[0])))


# Drawing truths, one function a case. Raise Redraw.


def _null(setting: ServoSetting, index: int, split: str, rng: np.random.Generator) -> tuple[DriveModel, Answer]:
    return setting.nominal, Answer("null")


def _single(setting: ServoSetting, index: int, split: str, rng: np.random.Generator) -> tuple[DriveModel, Answer]:
    return _with_effects(setting, "single", (list(SERVO_LIBRARY)[index % len(SERVO_LIBRARY)],), rng)


def _pair(setting: ServoSetting, index: int, split: str, rng: np.random.Generator) -> tuple[DriveModel, Answer]:
    """An effect of the drive, in turn, beside another."""
    first = [name for name, effect in SERVO_LIBRARY.items() if effect.source == "actuator"]
    names = (first[index % len(first)], str(rng.choice(list(SERVO_LIBRARY))))
    if not compatible(names) or any(pair <= set(names) for pair in _SETTERS):
        raise Redraw
    return _with_effects(setting, "pair", names, rng)


def _unknown(setting: ServoSetting, index: int, split: str, rng: np.random.Generator) -> tuple[DriveModel, Answer]:
    """An effect of the mechanics that no one has taught the diagnosis, in turn."""
    kinds = {name: kind for name, kind in UNKNOWN[split].items() if not (kind.command or kind.sensor)}
    name = list(kinds)[index % len(kinds)]
    family = kinds[name].draw(setting.nominal, setting.scale, rng)
    drive = _of_severity(setting, setting.nominal, family, rng, (1.5 * MILD, SEVERE))
    known = kinds[name].optional
    if not _distinct(setting, drive, setting.nominal, (*BELIEVED, *GAINS), _rivals(setting, drive, known, rng)):
        raise Redraw
    return drive, Answer("unknown", unknown=name, optional={each: {} for each in known})


_DRAWN: dict[str, Callable[..., tuple[DriveModel, Answer]]] = {
    "null": _null,
    "single": _single,
    "pair": _pair,
    "unknown": _unknown,
}


def _with_effects(
    setting: ServoSetting, case: str, names: Sequence[str], rng: np.random.Generator
) -> tuple[DriveModel, Answer]:
    """A servo with these effects, each of which shows beside the others and is like no refit."""
    drive = setting.nominal
    for name in names:
        effect = SERVO_LIBRARY[name]
        family = effect.draw(drive, setting.scale, rng)
        grown = _of_severity(setting, drive, family, rng, (MILD, SEVERE), LEAST.get(name, 0.0))
        if effect.source == "dynamics" and not _noticeable(setting, grown, effect):
            raise Redraw
        drive = grown
    if drive.cogging and drive.teeth * setting.scale.range < 1.2 * np.pi:
        raise Redraw  # less than a period of it is seen
    for name in names:
        fields = list(SERVO_LIBRARY[name].parameters.values())
        without = drive._replace(**{field: getattr(setting.nominal, field) for field in fields})
        if not MILD <= setting.severity(drive, without) <= 1.1 * SEVERE:
            raise Redraw
        if name != "encoder_quantization" and not _distinct(
            setting, drive, without, [each for each in (*BELIEVED, *GAINS) if each not in fields]
        ):
            raise Redraw
    effects: Effects = {
        name: {key: float(getattr(drive, field)) for key, field in SERVO_LIBRARY[name].parameters.items()}
        for name in names
    }
    return drive, Answer(case, effects, equivalents=[["torque_constant"]] if names == ("proportional_gain",) else [])


def _of_severity(
    setting: ServoSetting,
    without: DriveModel,
    family: Family,
    rng: np.random.Generator,
    bounds: tuple[float, float],
    least: float = 0.0,
) -> DriveModel:
    def severity(drive: DriveModel) -> float:
        return setting.severity(drive, without)

    return of_severity(severity, lambda x: without._replace(**family(x)), rng, bounds, least)


def _noticeable(setting: ServoSetting, drive: DriveModel, effect: KnownEffect) -> bool:
    """Whether a nominal value is off by more than few per cent, where it is not zero."""
    field = effect.parameters["value"]
    before, after = getattr(setting.nominal, field), getattr(drive, field)
    return not before or not 1 / NOTICEABLE < after / before < NOTICEABLE


def _rivals(
    setting: ServoSetting, drive: DriveModel, allowed: Collection[str], rng: np.random.Generator
) -> Iterator[DriveModel]:
    """Servos with one effect of the drive that is not allowed to be named, as large as what sets this one apart."""
    size = min(setting.severity(drive, setting.nominal), 30.0)
    actuator = [name for name, effect in SERVO_LIBRARY.items() if effect.source == "actuator" and name not in allowed]
    for name in actuator * 2:  # signs and the like are drawn twice
        family = SERVO_LIBRARY[name].draw(setting.nominal, setting.scale, rng)
        with suppress(Redraw):
            yield _of_severity(setting, setting.nominal, family, rng, (size, size), LEAST.get(name, 0.0))


def _distinct(
    setting: ServoSetting,
    drive: DriveModel,
    without: DriveModel,
    refitted: Sequence[str],
    rivals: Iterable[DriveModel] = (),
) -> bool:
    """Whether no refit of these fields, alone or beside as much of a rival as may be, imitates what sets two apart.

    Rivals are asked for one at a time, until one does.
    """
    base = setting.positions(drive._replace(resolution=0.0))
    change = base - setting.positions(without._replace(resolution=0.0))
    columns = []
    for field in refitted:
        value = getattr(without, field)
        step = 0.02 * abs(value) or 0.01 * setting.scale.torque * (0.01 if field == "derivative_gain" else 1.0)
        columns.append(setting.positions(without._replace(resolution=0.0, **{field: value + step})))
    more = (setting.positions(rival._replace(resolution=0.0)) for rival in rivals)

    def unlike(each: list[np.ndarray]) -> bool:
        others = np.stack(each, axis=1) - (base - change)[:, None]
        return left_over(change, others) >= DISTINCT * setting.noise[0]

    return all(map(unlike, chain([columns], ([*columns, each] for each in more))))


# The recording


def _recorded(
    setting: ServoSetting, drive: DriveModel, answer: Answer, velocity: str, rng: np.random.Generator
) -> GeneratedMachine:
    motion = setting.motion(drive, FINE)
    lag = float(rng.uniform(*LAG)) if velocity == "lagging" else 0.0
    columns: dict[str, list[np.ndarray]] = {"episode": [], "t": [], "target": [], "position": []}
    if velocity != "none":
        columns["velocity"] = []
    shown = []
    for k, (episode, rows) in enumerate(zip(setting.episodes, motion, strict=True)):
        noise = rng.normal(size=rows.shape) * setting.noise
        position = encoded(rows[:, 0] + noise[:, 0], drive.resolution)
        shown.append(encoded(rows[:, 0], drive.resolution))
        made = {"episode": np.full(len(rows), k), "t": episode.times, "target": episode.targets, "position": position}
        if velocity == "lagging":
            made["velocity"] = _register(drive, episode, lag) + noise[:, 1]
        elif velocity == "true":  # an encoder's is computed from its positions
            speed = np.gradient(position, episode.times) if drive.resolution else rows[:, 1] + noise[:, 1]
            made["velocity"] = speed
        for name, values in made.items():
            columns[name].append(values)
    table = {name: np.concatenate(values) for name, values in columns.items()}
    severity = _severity(setting, table["position"], np.concatenate(shown))
    notes: dict[str, Any] = {
        "rate": setting.rate,
        "velocity": velocity,
        "lag": lag,
        "noise": dict(zip(("position", "velocity"), setting.noise, strict=True)),
        "excitation": [episode.form for episode in setting.episodes],
        "machine": {k: float(v) for k, v in drive._asdict().items() if v != DriveModel._field_defaults.get(k)},
    }
    shrink = 1.0 if answer.effects else None  # the answer is all that there is
    answer = replace(answer, severity=severity, shrink=shrink, group=f"{setting.rate} Hz", notes=notes)
    return GeneratedMachine(answer, lambda folder: _write(folder, setting, table))


def _register(drive: DriveModel, episode: ServoEpisode, lag: float) -> np.ndarray:
    """The speed [T] (rad/s) of so many seconds before each row; the servo rested before the first one."""
    both = np.unique(np.concatenate([episode.times, np.maximum(episode.times - lag, 0.0)]))
    held = episode.targets[np.searchsorted(episode.times, both, side="right") - 1]
    rows = run_servo(drive, held, both, episode.targets[0], step_of(drive, FINE))
    return np.where(episode.times < lag, 0.0, np.interp(episode.times - lag, both, rows[:, 1]))


def _severity(setting: ServoSetting, measured: np.ndarray, shown: np.ndarray) -> float:
    """The gap of the simulator as it is believed, in units of what noise leaves."""

    def distance(positions: np.ndarray) -> float:
        return float(np.sqrt(np.mean((positions - measured) ** 2)))

    rows = np.concatenate(setting.motion(setting.nominal, FINE))
    return distance(rows[:, 0]) / distance(shown)


def _write(folder: Path, setting: ServoSetting, table: dict[str, np.ndarray]) -> None:
    nominal = setting.nominal
    head = {
        "format": "vision-s2r/recording/1",
        "kind": "joint",
        "sample_time": 1.0 / setting.rate,
        "nominal": {name: float(getattr(nominal, name)) for name in ("torque_constant", *BELIEVED)},
        "control": {
            "proportional": float(nominal.proportional_gain),
            "derivative": float(nominal.derivative_gain),
            "limit": float(nominal.command_limit),
        },
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    form = ["%d"] + ["%.9g"] * (len(table) - 1)
    rows = np.stack(list(table.values()), axis=1)
    np.savetxt(folder / "joint.csv", rows, form, ",", header=",".join(table), comments="")
