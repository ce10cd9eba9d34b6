"""Controllers: from what is seen to what is sent."""

from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from torch import nn

from vision_s2r.control.config import ControlTaskConfig
from vision_s2r.control.environment import observation_size
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.training import checkpoint

KIND = "controller"


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


class Policy:
    """A trained network's mean action: softened by nothing, the same for the same observation."""

    def __init__(self, network: nn.Sequential, history: int) -> None:
        self.history = history
        layers = [layer for layer in network if isinstance(layer, nn.Linear)]
        self._weights = [(each.weight.detach().numpy().T.copy(), each.bias.detach().numpy().copy()) for each in layers]

    def act(self, seen: np.ndarray) -> np.ndarray:
        """In NumPy: for one joint in real time, torch would spend most of its time on the way to the network."""
        *inner, (weight, bias) = self._weights
        for each, shift in inner:
            seen = np.tanh(seen @ each + shift)
        return np.clip(seen @ weight + bias, -1, 1)

    @classmethod
    def load(cls, path: str | Path, task: ControlTaskConfig) -> "Policy":
        """A policy for this task.

        Raises UserError for a file that is no controller, or one made for another task or another observation.
        """
        loaded = checkpoint.load(path, KIND)
        _same_task(loaded, task)
        history, hidden = int(loaded.configuration["history"]), list(loaded.configuration["hidden"])
        network = network_of(history, hidden)
        loaded.restore("network", network)
        return cls(network, history)


def network_of(history: int, hidden: list[int]) -> nn.Sequential:
    """The network of a policy: tanh between layers, one action."""
    sizes = [observation_size(history), *hidden]
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), nn.Tanh()]
    return nn.Sequential(*layers, nn.Linear(sizes[-1], 1))


def save(
    path: Path, network: nn.Sequential, task: ControlTaskConfig, history: int, hidden: list[int], facts: Any
) -> None:
    """Write a policy; `facts` say how it was trained."""
    configuration = {"task": _units(task), "history": history, "hidden": list(hidden)}
    tensors = {f"network.{name}": value for name, value in network.state_dict().items()}
    checkpoint.save(path, checkpoint.Checkpoint(KIND, configuration, {}, facts, tensors))


def _units(task: ControlTaskConfig) -> dict[str, float]:
    """What observations and actions are measured in."""
    return {name: value for name, value in asdict(task).items() if name in ("sample_time", "highest", "max_current")}


def _same_task(loaded: checkpoint.Checkpoint, task: ControlTaskConfig) -> None:
    has, wants = loaded.configuration.get("task", {}), _units(task)
    for name, value in wants.items():
        if has.get(name) != value:
            raise UserError(f"{loaded.path}: made for task.{name}={has.get(name)}, expected {value:g}")
