"""Training a policy; goes on where it was interrupted, with the same result."""

import random
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from vision_s2r import files
from vision_s2r.control import imitation, policy, ppo
from vision_s2r.control.config import ControlTaskConfig, ControlTrainingConfig, ImitationTrainingConfig
from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import Machines
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.threads import one_thread

Training = ControlTrainingConfig | ImitationTrainingConfig


@one_thread()
def train(
    task: ControlTaskConfig,
    nominal: NominalJoint,
    machines: Machines,
    history: int,
    training: Training,
    out: Path,
    seed: int,
    recurrent: bool = False,
) -> Path:
    """A policy for these machines, in `out`/policy.safetensors; returns that path, at once where it is there.

    With PPO, or from a teacher, as `training` is of the one or the other; the latter may be `recurrent`. `out` has
    progress.csv, the share of targets reached after each episode. Every episode ends in a state to resume from; a
    resumed training is the uninterrupted one, step by step. Raises UserError where `out` holds a training with other
    settings.
    """
    settings = {
        "task": asdict(task),
        "nominal": asdict(nominal),
        "machines": machines.described,
        "history": history,
        "recurrent": recurrent,
        "training": asdict(training),
        "seed": seed,
    }
    if name := files.differing(out / "settings.json", settings):
        raise UserError(f"{out}: holds a training with other settings ({name}), expected another out=")
    released = out / "policy.safetensors"
    if released.exists():
        return released
    environment = SpeedTracking(task, nominal, machines, training.envs, history, seed)
    with _generators_kept():
        if isinstance(training, ImitationTrainingConfig):
            network: policy.AnyNetwork = imitation.learn(environment, training, recurrent, out, seed)
        else:
            network = ppo.learn(environment, training, out, seed)
    policy.save(released, network, task, {"steps": training.steps, "seed": seed})
    return released


@contextmanager
def _generators_kept() -> Iterator[None]:
    """Leaves the process's own generators, which Stable-Baselines3 seeds and weights are drawn from, as they were."""
    python, numpy = random.getstate(), np.random.get_state()  # noqa: NPY002
    try:
        with torch.random.fork_rng(devices=[]):
            yield
    finally:
        random.setstate(python)
        np.random.set_state(numpy)  # noqa: NPY002
