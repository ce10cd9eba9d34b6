"""Keys of configs/actuator.yaml, where each is described."""

from dataclasses import dataclass, field
from typing import Any

from vision_s2r.errors import UserError
from vision_s2r.joint import JOINT_EFFECTS

PAPER_HISTORY = (0.0, 0.01, 0.02)  # s ago: Hwangbo et al. 2019


@dataclass
class DriveConfig:
    """A motor with an inner position controller: what the simulator knows of it, what it has besides, its sensors."""

    inertia: float = 0.02
    viscous_damping: float = 0.1
    coulomb_friction: float = 0.02
    torque_limit: float = 0.7
    stiffness: float = 6.0
    damping: float = 0.4
    sample_time: float = 0.005
    effects: dict[str, dict[str, Any]] = field(default_factory=dict)
    position_noise: float = 1e-4
    velocity_noise: float = 5e-3
    torque_noise: float = 3e-3


@dataclass
class LogsConfig:
    """Motions under which the drive is logged."""

    motions: int = 750
    held_out: int = 60
    seconds: float = 4.0
    frequency: list[float] = field(default_factory=lambda: [0.5, 10.0])
    amplitude: list[float] = field(default_factory=lambda: [0.03, 0.3])
    dither: list[float] = field(default_factory=lambda: [1e-4, 5e-3])
    payload: float = 0.1
    position_gain: float = 1.0
    velocity_gain: float = 0.15


@dataclass
class ActuatorTrainingConfig:
    """Of each network."""

    steps: int = 10_000
    batch: int = 2048
    learning_rate: float = 0.02
    warmup: float = 0.1


@dataclass
class ActuatorTaskConfig:
    """References that controllers are tuned on and tried on, and how."""

    tuned_on: int = 12
    tried_on: int = 40
    seconds: float = 2.5
    frequency: list[float] = field(default_factory=lambda: [1.0, 7.0])
    acceleration: list[float] = field(default_factory=lambda: [7.0, 18.0])
    amplitude: float = 0.3
    payload: float = 0.1
    roughness: float = 0.1
    generations: int = 40
    population: int = 8
    tolerance: float = 0.25


@dataclass
class ActuatorConfig:
    """Everything that scripts/actuator.py reads."""

    out: str = "outputs/actuator"
    seed: int = 0
    seeds: int = 5
    history: list[float] = field(default_factory=lambda: [round(0.005 * k, 3) for k in range(13)])
    drive: DriveConfig = field(default_factory=DriveConfig)
    logs: LogsConfig = field(default_factory=LogsConfig)
    training: ActuatorTrainingConfig = field(default_factory=ActuatorTrainingConfig)
    task: ActuatorTaskConfig = field(default_factory=ActuatorTaskConfig)


def check(cfg: ActuatorConfig) -> None:
    """UserError unless every value can be."""
    _positive(
        cfg,
        "seeds drive.inertia drive.torque_limit drive.stiffness drive.sample_time logs.motions logs.held_out "
        "logs.seconds training.steps training.batch training.learning_rate task.tuned_on task.tried_on task.seconds "
        "task.amplitude task.generations task.population",
    )
    _not_negative(
        cfg,
        "seed drive.viscous_damping drive.coulomb_friction drive.damping drive.position_noise drive.velocity_noise "
        "drive.torque_noise logs.payload logs.position_gain logs.velocity_gain training.warmup task.payload "
        "task.roughness task.tolerance",
    )
    for key in ("logs.frequency", "logs.amplitude", "logs.dither", "task.frequency", "task.acceleration"):
        _range(key, _value(cfg, key))
    for name, values in cfg.drive.effects.items():
        JOINT_EFFECTS[name].check(values, f"drive.effects.{name}")
        if name in ("gravity_torque", "bias_torque", "torque_constant"):
            raise UserError(f"drive.effects.{name}: the load's torque is drawn (payload), the command is a torque")
    lags(PAPER_HISTORY, cfg.drive.sample_time)
    lags(cfg.history, cfg.drive.sample_time)
    if min(cfg.logs.seconds, cfg.task.seconds) < 2 * cfg.history[-1] + 0.2:
        raise UserError(
            f"logs and tasks of {cfg.logs.seconds:g} and {cfg.task.seconds:g} s are too short to learn from"
        )


def lags(history: "list[float] | tuple[float, ...]", sample_time: float) -> tuple[int, ...]:
    """How many samples ago each entry of a history (s ago) is. Raises UserError unless all are, in order, from 0 on."""
    samples = tuple(round(seconds / sample_time) for seconds in history)
    exact = all(abs(k * sample_time - seconds) < 1e-9 for k, seconds in zip(samples, history, strict=True))
    if not samples or samples[0] != 0 or list(samples) != sorted(set(samples)) or not exact:
        raise UserError(f"history is {list(history)}, expected rising multiples of {sample_time:g} s from 0 on")
    return samples


def _value(cfg: object, key: str) -> object:
    for name in key.split("."):
        cfg = getattr(cfg, name)
    return cfg


def _positive(cfg: ActuatorConfig, keys: str) -> None:
    for key in keys.split():
        if not _value(cfg, key) > 0:  # type: ignore[operator]  # all are numbers
            raise UserError(f"{key} is {_value(cfg, key)}, expected more than 0")


def _not_negative(cfg: ActuatorConfig, keys: str) -> None:
    for key in keys.split():
        if not _value(cfg, key) >= 0:  # type: ignore[operator]
            raise UserError(f"{key} is {_value(cfg, key)}, expected 0 or more")


def _range(key: str, value: object) -> None:
    if not (isinstance(value, list) and len(value) == 2 and 0 < value[0] <= value[1]):
        raise UserError(f"{key} is {value}, expected [low, high] with 0 < low ≤ high")
