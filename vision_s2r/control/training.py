"""Training a policy with PPO; goes on where it was interrupted, with the same result."""

import logging
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from torch import nn

from vision_s2r import files
from vision_s2r.control import policy as policies
from vision_s2r.control.adapter import Adapter
from vision_s2r.control.config import ControlTaskConfig, ControlTrainingConfig
from vision_s2r.control.environment import SpeedTracking
from vision_s2r.control.machines import Machines
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.threads import one_thread
from vision_s2r.training import checkpoint

log = logging.getLogger(__name__)

STATE = "state.pt"
LEAST_RATE = 0.02  # of the learning rate, at the end: the last bit of accuracy wants small steps


@one_thread()
def train(
    task: ControlTaskConfig,
    nominal: NominalJoint,
    machines: Machines,
    history: int,
    training: ControlTrainingConfig,
    out: Path,
    seed: int,
) -> Path:
    """A policy for these machines, in `out`/policy.safetensors; returns that path, at once where it is there.

    `out`/progress.csv has the share of targets reached after each episode. Every episode ends in a state to resume
    from; a resumed training is the uninterrupted one, step by step. Raises UserError where `out` holds a training with
    other settings.
    """
    settings = {
        "task": asdict(task),
        "nominal": asdict(nominal),
        "machines": machines.described,
        "history": history,
        "training": asdict(training),
        "seed": seed,
    }
    if name := files.differing(out / "settings.json", settings):
        raise UserError(f"{out}: holds a training with other settings ({name}), expected another out=")
    released = out / "policy.safetensors"
    if released.exists():
        return released
    environment = Adapter(SpeedTracking(task, nominal, machines, training.envs, history, seed))
    model = _model(environment, training, seed)
    progress = _Progress(environment, history, training.hidden, out)
    progress.resume(model)
    left = training.steps - model.num_timesteps
    if left > 0:
        model.learn(left, progress, reset_num_timesteps=False)
    network = _released(model, history, training.hidden)
    facts = {"steps": model.num_timesteps, "seed": seed}
    policies.save(released, network, task, history, training.hidden, facts)
    return released


def machines_of(out: Path) -> dict[str, Any]:
    """The `state` of the machines that the training in `out` ended with."""
    state: dict[str, Any] = checkpoint.load_state(out / STATE)["machines"]
    return state


def _model(environment: Adapter, training: ControlTrainingConfig, seed: int) -> PPO:
    def rate(left: float) -> float:
        return training.learning_rate * min(max(left / training.decay, LEAST_RATE), 1.0)

    return PPO(
        "MlpPolicy",
        environment,
        n_steps=training.rollout,
        batch_size=training.batch,
        n_epochs=training.epochs,
        learning_rate=rate,
        gamma=training.discount,
        gae_lambda=training.trace,
        clip_range=training.clip,
        policy_kwargs={"net_arch": list(training.hidden), "log_std_init": float(np.log(training.first_std))},
        seed=seed,
        device="cpu",
    )


def _released(model: PPO, history: int, hidden: list[int]) -> nn.Sequential:
    """What acts, without what it was trained with."""
    network = policies.network_of(history, hidden)
    trained = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
    for ours, theirs in zip(network, trained, strict=True):
        ours.load_state_dict(theirs.state_dict())
    return network


class _Progress(BaseCallback):
    """After each episode a line in progress.csv and a state to resume from; after each update, word to the machines."""

    def __init__(self, environment: Adapter, history: int, hidden: list[int], out: Path) -> None:
        super().__init__()
        self.environment, self.history, self.hidden, self.out = environment, history, hidden, out
        self.machines = environment.environment.machines
        self.rows: list[list[float]] = []
        self.saved_at = 0

    def resume(self, model: PPO) -> None:
        """Go on from the last state in `out`, if there is one."""
        path = self.out / STATE
        if not path.exists():
            return
        state = checkpoint.load_state(path)
        model.policy.load_state_dict(state["policy"])
        model.policy.optimizer.load_state_dict(state["optimizer"])
        model.num_timesteps = self.saved_at = state["steps"]
        torch.set_rng_state(state["torch"])
        np.random.set_state(state["numpy"])  # noqa: NPY002 (Stable-Baselines3 draws from it)
        self.environment.environment.rng.bit_generator.state = state["environment"]
        self.machines.restore(state["machines"])
        self.rows = state["rows"]
        log.info("%s: goes on at step %d", self.out, self.saved_at)

    def _on_rollout_start(self) -> None:
        errors = self.environment.errors
        if errors is not None and self.environment.environment.sample == 0 and self.num_timesteps > self.saved_at:
            reached = float(np.mean(np.abs(errors) < self.environment.environment.task.tolerance))
            self.rows.append([self.num_timesteps, reached, float(np.median(np.abs(errors)))])
            files.write(self.out / "progress.csv", _table(self.rows))
            self._save()
        # After the state is saved, which the present episode began in: a resumed training comes by here again.
        assert isinstance(self.model, PPO)
        self.machines.updated(policies.Policy(_released(self.model, self.history, self.hidden), self.history))

    def _save(self) -> None:
        policy = self.model.policy
        numpy = np.random.get_state(legacy=False)  # noqa: NPY002
        checkpoint.save_state(
            self.out / STATE,
            {
                "policy": policy.state_dict(),
                "optimizer": policy.optimizer.state_dict(),
                "steps": self.num_timesteps,
                "torch": torch.get_rng_state(),
                "numpy": {**numpy, "state": {**numpy["state"], "key": numpy["state"]["key"].tolist()}},
                "environment": self.environment.environment.began_with,
                "machines": self.machines.state(),
                "rows": self.rows,
            },
        )
        self.saved_at = self.num_timesteps

    def _on_training_end(self) -> None:
        self._save()

    def _on_step(self) -> bool:
        return True


def _table(rows: list[list[float]]) -> str:
    lines = [",".join(f"{value:g}" for value in row) for row in rows]
    return "\n".join(["step,reached,median_error", *lines, ""])
