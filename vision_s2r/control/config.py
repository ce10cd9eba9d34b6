"""The configuration of controllers trained across the dynamics gap."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate
from vision_s2r.parallel import backend_option

Effects = dict[str, dict[str, Any]]  # by effect and parameter: a number or [low, high]
LEAST_RATE = 0.02  # of the learning rate, at the end of any training: the last bit of accuracy wants small steps
FRICTION: Effects = {"viscous_damping": {"value": [0.08, 0.20]}, "coulomb_friction": {"value": [0.01, 0.06]}}
# Every effect of a joint at once; a machine has some of them.
DRIVE: Effects = {
    **FRICTION,
    "inertia": {"value": [0.01, 0.08], "probability": 0.5},
    "asymmetric_friction": {"viscous": [-0.05, 0.05], "coulomb": [-0.015, 0.015], "probability": 0.15},
    "load_dependent_friction": {"coefficient": [0.0, 0.25], "probability": 0.15},
    "stribeck_friction": {"static": [0.03, 0.10], "velocity": [0.05, 0.4]},
    "cogging": {"amplitude": [0.0, 0.12], "teeth": [6, 24], "probability": 0.15},
    "thermal_drift": {"rate": [0.0, 0.1], "probability": 0.15},
    "back_emf": {"value": [0.0, 0.3], "probability": 0.15},
    "latency": {"delay": [0.0, 0.02], "probability": 0.3},
    "backlash": {"width": [0.005, 0.05], "probability": 0.3},
    "encoder_quantization": {"resolution": [0.001, 0.015], "probability": 0.15},
    "compliance": {"stiffness": [3.0, 12.0], "damping": [0.005, 0.03], "probability": 0.25},
    "torque_saturation": {"limit": [0.4, 1.5], "probability": 0.1},
    "torque_speed_limit": {"stall": [0.5, 1.5], "no_load_speed": [8.0, 20.0], "probability": 0.1},
}


@dataclass
class JointConfig:
    """The joint as the simulator believes it to be, as `vision_s2r.joint.NominalJoint`."""

    torque_constant: float = option(0.5, "N·m/A.")
    inertia: float = option(0.02, "kg·m².")
    viscous_damping: float = option(0.1, "N·m·s/rad.")
    coulomb_friction: float = option(0.02, "N·m.")
    gravity_torque: float = option(0.0, "N·m.")
    bias_torque: float = option(0.0, "N·m.")


@dataclass
class ControlTaskConfig:
    """Speed tracking: an episode is a row of target speeds, each held for a while."""

    sample_time: float = option(0.01, "Between commands, s.", above=0)
    lowest: float = option(1.0, "Target speeds are drawn from ± this on, rad/s …", above=0)
    highest: float = option(8.0, "… up to ± this, rad/s.", above=0)
    max_current: float = option(4.0, "The most that can be commanded, A.", above=0)
    targets: int = option(25, "An episode.", low=1)
    hold: float = option(0.4, "For which each is held, s.", above=0)
    settled: float = option(0.1, "The speed that counts is the mean of the last seconds of a target: so many.", above=0)
    tolerance: float = option(
        0.01, "It is reached where that speed is off by no more than this share of the target.", above=0
    )


@dataclass
class ControlTrainingConfig:
    """PPO."""

    envs: int = option(256, "Joints side by side.", low=1)
    steps: int = option(2_000_000, "Environment steps of a training, all joints together.", low=1)
    rollout: int = option(125, "Steps of each joint between updates; divides the samples of an episode.", low=1)
    batch: int = option(4000, "Samples of a gradient step.", low=1)
    epochs: int = option(8, "Passes over a rollout.", low=1)
    learning_rate: float = option(2e-3, "Of Adam.", above=0)
    decay: float = option(1.0, "In the last part of the steps, by this share, it falls to a fiftieth.")
    discount: float = option(0.9, "PPO's discount.", low=0, high=1)
    trace: float = option(0.9, "Trace decay of the advantage (GAE).", low=0, high=1)
    clip: float = option(0.2, "PPO's clipping range.", above=0)
    first_std: float = option(0.37, "Standard deviation of actions, in units of max_current, to begin with.", above=0)
    hidden: list[int] = option([32, 32], "Width of each hidden layer.", low=1)


@dataclass
class ImitationTrainingConfig:
    """Learning from a teacher that is told the machine, where the policy itself leads."""

    envs: int = option(128, "Joints side by side.", low=1)
    steps: int = option(12_000_000, "Environment steps of a training, all joints together.", low=1)
    window: int = option(50, "Samples of each joint in a gradient step; a memory is traced back so far.", low=1)
    passes: int = option(4, "Over an episode.", low=1)
    led: float = option(0.3, "The share of the steps in which fewer and fewer joints are led by the teacher.", above=0)
    effort: float = option(
        0.1, "What an ampere squared costs the teacher, beside the square of a speed that is wrong by 1 rad/s.", above=0
    )
    learning_rate: float = option(2e-3, "Of Adam; it falls to a fiftieth.", above=0)
    hidden: list[int] = option(
        [64, 64], "Width of each hidden layer; where a policy is recurrent, the last remembers.", low=1
    )


@dataclass
class PolicyConfig:
    """A policy to train: what it sees, and the machines that it is trained on."""

    history: int = option(0, "How many samples back (velocity and current) it sees.", low=0)
    method: str = option(
        "ppo",
        "How it learns: ppo (from rewards; key training), or imitation (from a teacher that knows the machine; key "
        "imitation).",
        choices=("ppo", "imitation"),
    )
    recurrent: bool = option(False, "Whether it remembers the episode, where it learns by imitation.")
    effects: Effects = option(
        {}, "By effect: probability (1 if left out) and each of its parameters, a number or [low, high]."
    )
    distribution: str = option(
        "", "Instead of effects: a file of ranges or of a posterior, as `vision-s2r identify` writes it."
    )


@dataclass
class DriftConfig:
    """Damping that grows steadily from the true one while the joint runs at one speed."""

    minutes: float = option(60.0, "For which the joint runs.", above=0)
    damping: float = option(0.25, "In the end, N·m·s/rad; the randomized range ends at 0.20.", low=0)
    speed: float = option(5.0, "rad/s.", above=0)


@dataclass
class CeilingConfig:
    """The search for what a controller that knows the machine can reach."""

    knots: int = option(11, "Currents planned for a target, straight lines between them.", low=2)
    samples: int = option(60, "Plans tried in an iteration of the cross-entropy method.", low=2)
    elites: int = option(8, "Of which so many are kept.", low=1)
    iterations: int = option(12, "Iterations.", low=1)


@dataclass
class ControlAblationConfig:
    """One randomization frozen at a time."""

    policy: PolicyConfig = option(
        PolicyConfig(
            history=4,
            effects={
                "time_step": {"scale": [0.7, 1.5]},
                "latency": {"delay": [0.0, 0.02]},
                "observation_noise": {"sigma": [0.0, 0.1]},
                **FRICTION,
                "inertia": {"value": [0.01, 0.06]},
                "torque_constant": {"value": [0.35, 0.65]},
            },
        ),
        "The policy that is randomized in everything.",
    )
    groups: dict[str, list[str]] = option(
        {
            "time step and latency": ["time_step", "latency"],
            "observation noise": ["observation_noise"],
            "friction": ["viscous_damping", "coulomb_friction"],
            "inertia": ["inertia"],
            "gains": ["torque_constant"],
        },
        "Of these groups of effects, one at a time stays as the simulator believes it to be.",
    )
    reality: Effects = option(
        {
            "time_step": {"scale": [0.9, 1.3]},
            "latency": {"delay": [0.005, 0.015]},
            "observation_noise": {"sigma": [0.02, 0.06]},
            "viscous_damping": {"value": [0.13, 0.17]},
            "coulomb_friction": {"value": [0.04, 0.06]},
            "inertia": {"value": [0.03, 0.05]},
            "torque_constant": {"value": [0.40, 0.45]},
        },
        "Machines that it is tried on.",
    )
    machines: int = option(200, "How many of them.", low=1)
    seeds: int = option(5, "Trainings of each policy.", low=1)
    steps: int = option(1_500_000, "Environment steps of a training.", low=1)


@dataclass
class ControlAdrConfig:
    """Automatic domain randomization, against hand-picked ranges."""

    history: int = option(4, "How many samples back policies see; they remember, and learn by imitation.", low=0)
    steps: int = option(3_000_000, "Environment steps of a training.", low=1)
    evaluations: int = option(512, "Joints on which the policy is tried after each episode.", low=1)
    every: int = option(1, "Of its episodes between these trials.", low=1)
    buffer: int = option(30, "Results at a boundary from which a decision is made.")
    threshold_high: float = option(
        20.0, "Targets reached (of task.targets, of those that can be) at a boundary from which on it moves outwards …"
    )
    threshold_low: float = option(10.0, "… and down from which inwards.")
    step: float = option(0.08, "By how much it moves, as a share of the limits.")
    boundary_probability: float = option(0.5, "With which a joint is at a boundary.")
    until: float = option(
        0.6, "The share of the steps after which ranges stay as they are, for the policy to become exact within them."
    )
    tolerance: float = option(
        0.05,
        "For moving a boundary, a target counts as reached where the joint is off by no more than this share of it.",
    )
    limits: Effects = option(
        {
            "viscous_damping": {"value": [0.0, 0.4]},
            "coulomb_friction": {"value": [0.0, 0.2]},
            "inertia": {"value": [0.005, 0.1]},
            "torque_constant": {"value": [0.25, 1.0]},
        },
        "Up to which ranges may widen, from the nominal joint on: by effect and parameter, [low, high].",
    )
    rival: str = option("history", "The policy whose hand-picked ranges it is compared with.")
    reality: Effects = option(
        {
            "viscous_damping": {"value": [0.09, 0.18]},
            "coulomb_friction": {"value": [0.03, 0.08]},
            "inertia": {"value": [0.015, 0.04]},
            "torque_constant": {"value": [0.42, 0.52]},
        },
        "Machines of reality, of which coverage is measured.",
    )
    outside: Effects = option(
        {
            "viscous_damping": {"value": [0.20, 0.30]},
            "coulomb_friction": {"value": [0.06, 0.12]},
            "inertia": {"value": [0.02, 0.06]},
            "torque_constant": {"value": [0.40, 0.55]},
        },
        "Machines outside the hand-picked ranges.",
    )
    machines: int = option(200, "How many of each.", low=1)


@dataclass
class ControlConfig:
    """Everything that `vision-s2r control` reads."""

    out: str = option(
        "outputs/control",
        "Trained policies (POLICY-SEED/), follow.json, ablate.json, adr.json, and a picture of each.",
    )
    seed: int = option(0, "Of the first training.", low=0)
    seeds: int = option(3, "How many trainings (seed, seed + 1, …) of each policy.", low=1)
    jobs: int = option(2, "Trainings at a time.", low=1)
    backend: str = backend_option()
    nominal: JointConfig = option(JointConfig, "The joint as the simulator believes it to be.")
    truth: Effects = option(
        {"viscous_damping": {"value": 0.15}, "coulomb_friction": {"value": 0.05}},
        "What is different in reality: effects, and their parameters.",
    )
    task: ControlTaskConfig = option(ControlTaskConfig, "Target speeds.")
    training: ControlTrainingConfig = option(ControlTrainingConfig, "PPO.")
    imitation: ImitationTrainingConfig = option(ImitationTrainingConfig, "Learning from a teacher.")
    policies: dict[str, PolicyConfig] = option(
        {
            "default": PolicyConfig(),
            "randomized": PolicyConfig(effects=FRICTION),
            "history": PolicyConfig(history=4, effects=FRICTION),
            "window": PolicyConfig(history=40, method="imitation", effects=DRIVE),
            "memory": PolicyConfig(history=4, method="imitation", recurrent=True, effects=DRIVE),
        },
        "Policies to train, by name.",
    )
    only: list[str] = option([], "Names of the policies that `follow` trains and tries; empty: all.", unique=True)
    ceiling: CeilingConfig = option(CeilingConfig, "What can be reached at all.")
    edges: Effects = option(FRICTION, "Every corner of these ranges is a machine of reality.")
    payloads: list[float] = option([0.5, 2.0, 4.0], "How many times its inertia the joint has to move.")
    drift: DriftConfig = option(DriftConfig, "Damping that grows.")
    ablation: ControlAblationConfig = option(ControlAblationConfig, "One randomization frozen at a time.")
    adr: ControlAdrConfig = option(ControlAdrConfig, "Automatic domain randomization.")


def check(cfg: ControlConfig) -> None:
    """UserError for a value that cannot be."""
    validate(cfg)
    task, training = cfg.task, cfg.training
    if task.lowest > task.highest:
        raise UserError(f"task.lowest = {task.lowest:g}: expected up to task.highest = {task.highest:g}")
    if not task.sample_time <= task.settled <= task.hold:
        raise UserError(f"task.settled = {task.settled:g}: expected {task.sample_time:g} to task.hold = {task.hold:g}")
    if episode_samples(task) % training.rollout:
        raise UserError(
            f"training.rollout = {training.rollout}: expected to divide an episode's {episode_samples(task)} samples"
        )


def held_samples(task: ControlTaskConfig) -> int:
    """Samples for which a target is held."""
    return round(task.hold / task.sample_time)


def episode_samples(task: ControlTaskConfig) -> int:
    """Samples of an episode."""
    return task.targets * held_samples(task)


# Its parts with their types, its top open: the command line may add policies.
ConfigStore.instance().store("control_schema", node=vars(ControlConfig()))
