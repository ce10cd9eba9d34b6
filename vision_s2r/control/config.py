"""Keys of configs/control.yaml, where each is described."""

from dataclasses import dataclass, field
from typing import Any

from vision_s2r.errors import UserError


@dataclass
class JointConfig:
    """The nominal joint, as `vision_s2r.joint.Nominal`."""

    torque_constant: float = 0.5
    inertia: float = 0.02
    viscous_damping: float = 0.1
    coulomb_friction: float = 0.02
    gravity_torque: float = 0.0
    bias_torque: float = 0.0


@dataclass
class ControlTaskConfig:
    """Speed tracking: an episode is a row of target speeds, each held for a while."""

    sample_time: float = 0.01
    lowest: float = 1.0
    highest: float = 8.0
    max_current: float = 4.0
    targets: int = 25
    hold: float = 0.4
    settled: float = 0.1
    tolerance: float = 0.01


@dataclass
class ControlTrainingConfig:
    """PPO."""

    envs: int = 256
    steps: int = 2_000_000
    rollout: int = 125
    batch: int = 4000
    epochs: int = 8
    learning_rate: float = 2e-3
    decay: float = 1.0
    discount: float = 0.9
    trace: float = 0.9
    clip: float = 0.2
    first_std: float = 0.37
    hidden: list[int] = field(default_factory=lambda: [32, 32])


@dataclass
class PolicyConfig:
    """A policy to train: what it sees, and the machines that it is trained on."""

    history: int = 0
    # By effect: probability (1 if left out) and each of its parameters, a number or [low, high].
    effects: dict[str, dict[str, Any]] = field(default_factory=dict)
    distribution: str = ""


@dataclass
class DriftConfig:
    """Damping that grows while the joint runs."""

    minutes: float = 60.0
    damping: float = 0.25
    speed: float = 5.0


@dataclass
class ControlAblationConfig:
    """One randomization frozen at a time."""

    policy: PolicyConfig = field(default_factory=PolicyConfig)
    groups: dict[str, list[str]] = field(default_factory=dict)
    reality: dict[str, dict[str, Any]] = field(default_factory=dict)
    machines: int = 200
    seeds: int = 5
    steps: int = 1_500_000


@dataclass
class ControlAdrConfig:
    """Ranges that adr by themselves, against hand-picked ones."""

    history: int = 8
    steps: int = 6_000_000
    evaluations: int = 2048
    every: int = 2
    buffer: int = 240
    threshold_high: float = 20.0
    threshold_low: float = 10.0
    step: float = 0.02
    boundary_probability: float = 0.5
    until: float = 0.5
    decay: float = 0.4
    tolerance: float = 0.05
    limits: dict[str, dict[str, Any]] = field(default_factory=dict)
    rival: str = "history"
    reality: dict[str, dict[str, Any]] = field(default_factory=dict)
    outside: dict[str, dict[str, Any]] = field(default_factory=dict)
    machines: int = 200


@dataclass
class ControlConfig:
    """Everything that scripts/control.py reads."""

    out: str = "outputs/control"
    seed: int = 0
    seeds: int = 3
    jobs: int = 2
    nominal: JointConfig = field(default_factory=JointConfig)
    truth: dict[str, dict[str, Any]] = field(default_factory=dict)
    task: ControlTaskConfig = field(default_factory=ControlTaskConfig)
    training: ControlTrainingConfig = field(default_factory=ControlTrainingConfig)
    policies: dict[str, PolicyConfig] = field(default_factory=dict)
    payloads: list[float] = field(default_factory=lambda: [1.0])
    drift: DriftConfig = field(default_factory=DriftConfig)
    ablation: ControlAblationConfig = field(default_factory=ControlAblationConfig)
    adr: ControlAdrConfig = field(default_factory=ControlAdrConfig)


def check(cfg: ControlConfig) -> None:
    """UserError for a value that cannot be."""
    task, training = cfg.task, cfg.training
    if not 0 < task.lowest <= task.highest:
        raise UserError(f"task: lowest={task.lowest:g}, highest={task.highest:g}: expected 0 < lowest <= highest")
    for name in ("sample_time", "max_current", "hold", "settled", "tolerance"):
        if not getattr(task, name) > 0:
            raise UserError(f"task: {name}={getattr(task, name):g}, expected more than 0")
    if not task.sample_time <= task.settled <= task.hold:
        raise UserError(f"task: settled={task.settled:g}, expected {task.sample_time:g} to hold={task.hold:g}")
    for name in ("envs", "steps", "rollout", "batch", "epochs"):
        if getattr(training, name) < 1:
            raise UserError(f"training: {name}={getattr(training, name)}, expected 1 or more")
    if episode_samples(task) % training.rollout:
        raise UserError(
            f"training: rollout={training.rollout}, expected to divide an episode's {episode_samples(task)} samples"
        )
    if cfg.seeds < 1 or cfg.jobs < 1 or cfg.seed < 0 or task.targets < 1:
        raise UserError("expected seeds, jobs and task.targets of 1 or more, and seed of 0 or more")


def held_samples(task: ControlTaskConfig) -> int:
    """Samples for which a target is held."""
    return round(task.hold / task.sample_time)


def episode_samples(task: ControlTaskConfig) -> int:
    """Samples of an episode."""
    return task.targets * held_samples(task)
