"""Controllers: from what is seen to what is sent."""

from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from vision_s2r.control.config import ControlTaskConfig
from vision_s2r.control.environment import history_of, observation_size
from vision_s2r.control.machines import Values
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.training import checkpoint

KIND = "controller"
DYNAMICS = ("viscous_damping", "coulomb_friction", "inertia", "torque_constant")
LEAST_DAMPING = 1e-6  # N·m·s/rad


class OpenLoop:
    """The current that the nominal joint would need to go on at the target speed, whatever is measured."""

    history = 0

    def __init__(self, nominal: NominalJoint, task: ControlTaskConfig) -> None:
        self.nominal, self.task = nominal, task

    def act(self, seen: np.ndarray) -> np.ndarray:
        """The inverse of the nominal steady state."""
        target = seen[:, :1].astype(float) * self.task.highest
        torque = self.nominal.viscous_damping * target + self.nominal.coulomb_friction * np.sign(target)
        return np.clip(torque / self.nominal.torque_constant / self.task.max_current, -1, 1)


class Informed:
    """Knows the friction, inertia and gain of each joint, by `values` [N], and is at the target as soon as may be.

    Deadbeat control, exact for a joint without other effects: the current after which the next sample is at the target,
    or the most.
    """

    history = 0

    def __init__(self, nominal: NominalJoint, values: Values, task: ControlTaskConfig) -> None:
        self.task = task
        known = {name: values.get(name, {}).get("value", getattr(nominal, name)) for name in DYNAMICS}
        self.damping, self.friction = known["viscous_damping"], known["coulomb_friction"]
        self.inertia, self.gain = known["inertia"], known["torque_constant"]

    def act(self, seen: np.ndarray) -> np.ndarray:
        """What moves the joint from its velocity to the target within a sample."""
        target, velocity = self.task.highest * seen[:, :2].astype(float).T
        rate = np.maximum(self.damping, LEAST_DAMPING) / self.inertia
        left = np.exp(-rate * self.task.sample_time)
        torque = (target - left * velocity) * rate * self.inertia / (1 - left)
        torque += self.friction * np.sign(np.where(velocity == 0, target, velocity))
        return np.clip(torque / self.gain / self.task.max_current, -1, 1)[:, None]


class Network(nn.Module):
    """Layers of tanh, and one action from the last of them; `straight`: and from what is seen, beside it.

    The straight way is a linear controller (go on with the last current, a bit more for what is missing), which tanh
    would have to imitate to a tenth of a per cent; the layers then only correct it.
    """

    def __init__(self, inputs: int, hidden: list[int], straight: bool) -> None:
        super().__init__()
        self.inputs, self.hidden, self.straight = inputs, list(hidden), straight
        self.layers = layers(inputs, hidden)
        self.action = nn.Linear(hidden[-1] + straight * inputs, 1)

    def forward(self, seen: Tensor) -> Tensor:
        """Mean actions [N, 1] for observations [N, inputs]."""
        last = self.layers(seen)
        action: Tensor = self.action(torch.cat([last, seen], dim=1) if self.straight else last)
        return action


def layers(inputs: int, hidden: list[int]) -> nn.Sequential:
    """Linear layers with tanh after each."""
    found: list[nn.Module] = []
    for before, after in pairwise([inputs, *hidden]):
        found += [nn.Linear(before, after), nn.Tanh()]
    return nn.Sequential(*found)


class Policy:
    """A trained network's mean action: softened by nothing, the same for the same observation."""

    def __init__(self, network: Network) -> None:
        self.history, self._straight = history_of(network.inputs), network.straight
        linear = [each for each in network.modules() if isinstance(each, nn.Linear)]
        self._weights = [(each.weight.detach().numpy().T.copy(), each.bias.detach().numpy().copy()) for each in linear]

    def act(self, seen: np.ndarray) -> np.ndarray:
        """In NumPy: for one joint in real time, torch would spend most of its time on the way to the network."""
        *inner, (weight, bias) = self._weights
        last = seen
        for each, shift in inner:
            last = np.tanh(last @ each + shift)
        if self._straight:
            last = np.concatenate([last, seen], axis=1)
        return np.clip(last @ weight + bias, -1, 1)

    @classmethod
    def load(cls, path: str | Path, task: ControlTaskConfig) -> "Policy":
        """A policy for this task.

        Raises UserError for a file that is no controller, or one made for another task or another observation.
        """
        loaded = checkpoint.load(path, KIND)
        _same_task(loaded, task)
        known = loaded.configuration
        network = Network(observation_size(int(known["history"])), list(known["hidden"]), bool(known["straight"]))
        loaded.restore("network", network)
        return cls(network)


def save(path: Path, network: Network, task: ControlTaskConfig, facts: Any) -> None:
    """Write a policy; `facts` say how it was trained."""
    shape = {"history": history_of(network.inputs), "hidden": network.hidden, "straight": network.straight}
    tensors = {f"network.{name}": value for name, value in network.state_dict().items()}
    checkpoint.save(path, checkpoint.Checkpoint(KIND, {"task": _units(task), **shape}, {}, facts, tensors))


def _units(task: ControlTaskConfig) -> dict[str, float]:
    """What observations and actions are measured in."""
    return {name: value for name, value in asdict(task).items() if name in ("sample_time", "highest", "max_current")}


def _same_task(loaded: checkpoint.Checkpoint, task: ControlTaskConfig) -> None:
    has, wants = loaded.configuration.get("task", {}), _units(task)
    for name, value in wants.items():
        if has.get(name) != value:
            raise UserError(f"{loaded.path}: made for task.{name}={has.get(name)}, expected {value:g}")
