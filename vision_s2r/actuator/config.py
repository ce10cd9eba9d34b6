"""The configuration of actuator networks: what drives, logs, training and policies are."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.options import option, validate

PAPER_HISTORY = (0.0, 0.01, 0.02)  # s ago: Hwangbo et al. 2019


@dataclass
class DriveConfig:
    """A motor with an inner position controller: what the simulator knows of it, what it has besides, its sensors."""

    inertia: float = option(0.02, "Of the joint as the simulator knows it, kg·m².", above=0)
    viscous_damping: float = option(0.1, "N·m·s/rad.", low=0)
    coulomb_friction: float = option(0.02, "N·m.", low=0)
    torque_limit: float = option(0.7, "The most that its motor gives at rest, N·m.", above=0)
    stiffness: float = option(6.0, "Of the inner position controller, N·m/rad.", above=0)
    damping: float = option(0.4, "Of the inner position controller, N·m·s/rad.", low=0)
    sample_time: float = option(0.005, "Between samples, of commands, logs and simulation alike, s.", above=0)
    effects: dict[str, dict[str, Any]] = option(
        {
            "backlash": {"width": 0.005},  # a third of a degree, as of a good servo's gear
            "latency": {"delay": 0.015},
            "torque_speed_limit": {"stall": 0.7, "no_load_speed": 10.0},
        },
        "What the drive has and the simulator lacks: effects of vision_s2r/joint, and their parameters.",
    )
    position_noise: float = option(1e-4, "Standard deviation of the sensor's noise, rad.", low=0)
    velocity_noise: float = option(5e-3, "Standard deviation of the sensor's noise, rad/s.", low=0)
    torque_noise: float = option(3e-3, "Standard deviation of the sensor's noise, N·m.", low=0)


@dataclass
class LogsConfig:
    """Motions under which the drive is logged: each the sum of two sine sweeps."""

    minutes: list[float] = option(
        [0.2, 3.0, 50.0],
        "How much of the drive's log a simulator is made from, min: one each, to whole motions, at least one.",
        above=0,
        rising=True,
    )
    diagnosed: float = option(
        0.2, "Of these, up to how much is diagnosed and identified too, min: it costs seconds a motion.", low=0
    )
    held_out: int = option(60, "Others, to validate on.", above=0)
    seconds: float = option(4.0, "Of each.", above=0)
    frequency: list[float] = option(
        [0.5, 10.0], "Ends of a sweep are drawn between these, Hz.", length=2, above=0, rising=True
    )
    amplitude: list[float] = option(
        [0.03, 0.3], "Its amplitude is drawn between these, rad.", length=2, above=0, rising=True
    )
    dither: list[float] = option(
        [1e-4, 5e-3],
        "The standard deviation of the noise on a motion's commands is drawn between these, rad.",
        length=2,
        above=0,
        rising=True,
    )
    payload: float = option(0.1, "The world's torque on the load, drawn between ± this, N·m.", low=0)
    position_gain: float = option(
        1.0, "The most that a motion's outer loop answers position errors with, as policies will.", low=0
    )
    velocity_gain: float = option(0.15, "The most that it answers velocity errors with, s.", low=0)


@dataclass
class ActuatorTrainingConfig:
    """Of each network."""

    steps: int = option(10_000, "Of each network.", above=0)
    batch: int = option(2048, "Samples a step.", above=0)
    learning_rate: float = option(
        0.02, "The highest, of Muon; it rises over the first part of the steps and falls to 0.", above=0
    )
    warmup: float = option(0.1, "The part of the steps over which it rises.", low=0)


@dataclass
class ActuatorTaskConfig:
    """References that policies learn and are tried on, and how: each the sum of three sines."""

    tried_on: int = option(40, "That policies are tried on.", above=0)
    seconds: float = option(2.5, "Of each.", above=0)
    frequency: list[float] = option(
        [1.0, 7.0], "Of the sines, drawn between these, Hz.", length=2, above=0, rising=True
    )
    acceleration: list[float] = option(
        [7.0, 18.0], "Of the sines, drawn between these, rad/s².", length=2, above=0, rising=True
    )
    amplitude: float = option(0.3, "The most that a sine moves, rad.", above=0)
    payload: float = option(
        0.1, "The world's torque on the load, drawn between ± this, N·m; the policy is not told.", low=0
    )
    effort: float = option(
        0.7, "The most torque that a task asks, of what the nominal motor gives at rest: a share.", above=0
    )
    roughness: float = option(
        0.1,
        "What a radian of (RMS) change of the command between samples costs, against a radian of (RMS) error.",
        low=0,
    )
    tolerance: float = option(
        0.25, "A policy transfers where its error on the drive is larger by no more than this share.", low=0
    )


@dataclass
class DrivePolicyConfig:
    """Policies, which learn by the gradient through a simulator."""

    history: int = option(12, "How many samples back they see.", low=0)
    drives: int = option(32, "Side by side.", low=1)
    episodes: int = option(12, "Of a task each, task.seconds long.", low=1)
    window: int = option(25, "Samples after which they are updated, and through which the gradient flows.", low=1)
    learning_rate: float = option(4e-3, "Of Adam; it falls to a fiftieth.", above=0)
    hidden: list[int] = option([64], "Width of each hidden layer.", low=1)


@dataclass
class ActuatorConfig:
    """Everything that `vision-s2r actuator` reads."""

    out: str = option(
        "outputs/actuator",
        "Networks, policies, actuator.json and actuator.png. An interrupted run goes on in its folder.",
    )
    seed: int = option(0, "Of the first log, network and policy.", low=0)
    seeds: int = option(5, "How many (seed, seed + 1, …) of each.", above=0)
    history: list[float] = option(
        [round(0.005 * k, 3) for k in range(13)],
        "What the second network sees, s ago, multiples of drive.sample_time. The first one sees 0, 0.01 and 0.02, as "
        "in the paper.",
    )
    drive: DriveConfig = option(DriveConfig, "The motor and its inner controller.")
    logs: LogsConfig = option(LogsConfig, "Motions under which it is logged.")
    training: ActuatorTrainingConfig = option(ActuatorTrainingConfig, "Of each network.")
    policy: DrivePolicyConfig = option(DrivePolicyConfig, "Policies trained in each simulator.")
    task: ActuatorTaskConfig = option(ActuatorTaskConfig, "References that they follow.")


def check(cfg: ActuatorConfig) -> None:
    """UserError unless every value can be."""
    validate(cfg)
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


ConfigStore.instance().store("actuator_schema", node=ActuatorConfig)
