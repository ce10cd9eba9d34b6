"""Learning a policy with PPO from Stable-Baselines3."""

from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from vision_s2r.control import policy as policies
from vision_s2r.control.adapter import Adapter
from vision_s2r.control.config import LEAST_RATE, ControlTrainingConfig
from vision_s2r.control.environment import SpeedTracking, observation_size
from vision_s2r.control.progress import Progress


def learn(environment: SpeedTracking, training: ControlTrainingConfig, out: Path, seed: int) -> policies.Network:
    """The network after `training.steps`; goes on where `out` stands."""
    adapter = Adapter(environment)
    model = _model(adapter, training, seed)
    callback = _Callback(adapter, training.hidden, Progress(out))
    callback.resume(model)
    left = training.steps - model.num_timesteps
    if left > 0:
        model.learn(left, callback, reset_num_timesteps=False)
    return _released(model, environment.history, training.hidden)


def _model(environment: Adapter, training: ControlTrainingConfig, seed: int) -> PPO:
    def rate(left: float) -> float:
        return training.learning_rate * min(max(left / training.decay, LEAST_RATE), 1.0)

    model = PPO(
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
    model.set_logger(Logger(folder=None, output_formats=[]))  # its own makes a folder among temporary files
    return model


def _released(model: PPO, history: int, hidden: list[int]) -> policies.Network:
    """What acts, without what it was trained with."""
    network = policies.Network(observation_size(history), hidden, straight=False)
    network.layers.load_state_dict(model.policy.mlp_extractor.policy_net.state_dict())
    network.action.load_state_dict(model.policy.action_net.state_dict())
    return network


class _Callback(BaseCallback):
    """After each episode its errors and a state to resume from; after each update, word to the machines."""

    def __init__(self, adapter: Adapter, hidden: list[int], progress: Progress) -> None:
        super().__init__()
        self.adapter, self.environment, self.hidden, self.progress = adapter, adapter.environment, hidden, progress

    def resume(self, model: PPO) -> None:
        """Go on from the last state, if there is one."""
        if (state := self.progress.state) is None:
            return
        model.policy.load_state_dict(state["policy"])
        model.policy.optimizer.load_state_dict(state["optimizer"])
        model.num_timesteps = self.progress.steps
        torch.set_rng_state(state["torch"])
        np.random.set_state(state["numpy"])  # noqa: NPY002 (Stable-Baselines3 draws from it)
        self.environment.rng.bit_generator.state = state["environment"]
        self.environment.machines.restore(state["machines"])

    def _on_rollout_start(self) -> None:
        self._note()
        # After the state is saved, which the present episode began in: a resumed training comes by here again.
        assert isinstance(self.model, PPO)
        network = _released(self.model, self.environment.history, self.hidden)
        self.environment.machines.updated(policies.Policy(network))

    def _note(self) -> None:
        """The episode that has just ended, once."""
        errors = self.adapter.errors
        if errors is None or self.environment.sample or self.num_timesteps == self.progress.steps:
            return
        numpy = np.random.get_state(legacy=False)  # noqa: NPY002
        self.progress.episode(
            self.num_timesteps,
            errors,
            self.environment.task.tolerance,
            {
                "policy": self.model.policy.state_dict(),
                "optimizer": self.model.policy.optimizer.state_dict(),
                "torch": torch.get_rng_state(),
                "numpy": {**numpy, "state": {**numpy["state"], "key": numpy["state"]["key"].tolist()}},
                "environment": self.environment.began_with,
                "machines": self.environment.machines.state(),
            },
        )

    def _on_training_end(self) -> None:
        self._note()

    def _on_step(self) -> bool:
        return True
