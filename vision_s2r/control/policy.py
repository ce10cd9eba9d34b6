"""Controllers: from what is seen to what is sent."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from vision_s2r.control.config import ControlTaskConfig
from vision_s2r.control.environment import history_of, observation_size
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.training import checkpoint

KIND = "controller"


class OpenLoop:
    """The current that the nominal joint would need to go on at the target speed, whatever is measured."""

    history = 0

    def __init__(self, nominal: NominalJoint, task: ControlTaskConfig) -> None:
        self.nominal, self.task = nominal, task

    def begin(self, count: int) -> None:
        """Nothing is remembered."""

    def act(self, seen: np.ndarray) -> np.ndarray:
        """The inverse of the nominal steady state."""
        target = seen[:, :1].astype(float) * self.task.highest
        torque = self.nominal.viscous_damping * target + self.nominal.coulomb_friction * np.sign(target)
        return np.clip(torque / self.nominal.torque_constant / self.task.max_current, -1, 1)


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

    @property
    def shape(self) -> dict[str, Any]:
        """What `network_of` makes another one from."""
        return {"history": history_of(self.inputs), "hidden": self.hidden, "straight": self.straight}

    def forward(self, seen: Tensor) -> Tensor:
        """Mean actions [N, 1] for observations [N, inputs]."""
        last = self.layers(seen)
        action: Tensor = self.action(torch.cat([last, seen], dim=1) if self.straight else last)
        return action

    def frozen(self) -> "_Layers":
        """The same in NumPy."""
        return _Layers(self)


class RecurrentNetwork(nn.Module):
    """A linear controller whose gains a memory schedules: what it has made out of the machine (GRU, Cho et al. 2014).

    Gains that are scheduled, not an action that is added: a joint with a spring wants another feedback than one
    without, and a sum of both is right for neither. The last of the `hidden` widths is the memory's.
    """

    def __init__(self, inputs: int, hidden: list[int]) -> None:
        super().__init__()
        self.inputs, self.hidden = inputs, list(hidden)
        *before, width = hidden
        self.layers = layers(inputs, before)
        self.memory = nn.GRU(before[-1] if before else inputs, width)
        self.gains = nn.Linear(hidden[-1], inputs + 1)

    @property
    def shape(self) -> dict[str, Any]:
        """What `network_of` makes another one from."""
        return {"history": history_of(self.inputs), "hidden": self.hidden, "recurrent": True}

    def forward(self, seen: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
        """Actions [T, N] for observations [T, N, inputs] one after the other; the memory [1, N, hidden] goes on."""
        recalled, memory = self.memory(self.layers(seen), memory)
        gains = self.gains(recalled)
        return (gains[..., :-1] * seen).sum(dim=-1) + gains[..., -1], memory

    def frozen(self) -> "_Recurrent":
        """The same in NumPy."""
        return _Recurrent(self)


AnyNetwork = Network | RecurrentNetwork


def network_of(shape: Mapping[str, Any]) -> AnyNetwork:
    """A network of this `shape`, untrained."""
    inputs, hidden = observation_size(int(shape["history"])), list(shape["hidden"])
    if shape.get("recurrent"):
        return RecurrentNetwork(inputs, hidden)
    return Network(inputs, hidden, bool(shape["straight"]))


def layers(inputs: int, hidden: list[int]) -> nn.Sequential:
    """Linear layers with tanh after each."""
    found: list[nn.Module] = []
    for before, after in pairwise([inputs, *hidden]):
        found += [nn.Linear(before, after), nn.Tanh()]
    return nn.Sequential(*found)


class _Layers:
    """A `Network` in NumPy: for one joint in real time, torch would spend most of its time on the way to it."""

    def __init__(self, network: Network) -> None:
        *self._inner, self._last = [_linear(each) for each in network.modules() if isinstance(each, nn.Linear)]
        self._straight = network.straight

    def begin(self, count: int) -> None:
        """Nothing is remembered."""

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Actions [N, 1]."""
        last = _through(self._inner, seen)
        if self._straight:
            last = np.concatenate([last, seen], axis=1)
        weight, bias = self._last
        actions: np.ndarray = last @ weight + bias
        return actions


class _Recurrent:
    """A `RecurrentNetwork` in NumPy, with its memory."""

    def __init__(self, network: RecurrentNetwork) -> None:
        self._inner = [_linear(each) for each in network.layers if isinstance(each, nn.Linear)]
        self._gains = _linear(network.gains)
        given = network.memory.state_dict()
        self._seen, self._recalled = (
            (given[f"weight_{way}_l0"].numpy().T.copy(), given[f"bias_{way}_l0"].numpy().copy()) for way in ("ih", "hh")
        )
        self._width = network.hidden[-1]
        self.begin(0)

    def begin(self, count: int) -> None:
        """Nothing is known of the joints yet."""
        self._memory = np.zeros((count, self._width), np.float32)

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Actions [N, 1]; what was seen is remembered."""
        new = _affine(_through(self._inner, seen), self._seen)
        old = _affine(self._memory, self._recalled)
        both = 2 * self._width
        reset, keep = np.split(1 / (1 + np.exp(-(new[:, :both] + old[:, :both]))), 2, axis=1)
        self._memory = (1 - keep) * np.tanh(new[:, both:] + reset * old[:, both:]) + keep * self._memory
        gains = _affine(self._memory, self._gains)
        actions: np.ndarray = (gains[:, :-1] * seen).sum(axis=1, keepdims=True) + gains[:, -1:]
        return actions


_Affine = tuple[np.ndarray, np.ndarray]


def _linear(layer: nn.Linear) -> _Affine:
    return layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy()


def _affine(seen: np.ndarray, layer: _Affine) -> np.ndarray:
    found: np.ndarray = seen @ layer[0] + layer[1]
    return found


def _through(inner: Sequence[_Affine], seen: np.ndarray) -> np.ndarray:
    for each in inner:
        seen = np.tanh(_affine(seen, each))
    return seen


class Policy:
    """A trained network's mean action: softened by nothing, the same for the same observations since `begin`."""

    def __init__(self, network: AnyNetwork) -> None:
        self.history = history_of(network.inputs)
        self._network = network.frozen()

    def begin(self, count: int) -> None:
        """An episode of so many joints begins."""
        self._network.begin(count)

    def act(self, seen: np.ndarray) -> np.ndarray:
        """Actions [N, 1]."""
        return np.clip(self._network.act(seen), -1, 1)

    @classmethod
    def load(cls, path: str | Path, task: ControlTaskConfig) -> "Policy":
        """A policy for this task.

        Raises UserError for a file that is no controller, or one made for another task or another observation.
        """
        loaded = checkpoint.load(path, KIND)
        _same_task(loaded, task)
        network = network_of(loaded.configuration)
        loaded.restore("network", network)
        return cls(network)


def save(path: Path, network: AnyNetwork, task: ControlTaskConfig, facts: Any) -> None:
    """Write a policy; `facts` say how it was trained."""
    tensors = {f"network.{name}": value for name, value in network.state_dict().items()}
    checkpoint.save(path, checkpoint.Checkpoint(KIND, {"task": _units(task), **network.shape}, {}, facts, tensors))


def _units(task: ControlTaskConfig) -> dict[str, float]:
    """What observations and actions are measured in."""
    return {name: value for name, value in asdict(task).items() if name in ("sample_time", "highest", "max_current")}


def _same_task(loaded: checkpoint.Checkpoint, task: ControlTaskConfig) -> None:
    has, wants = loaded.configuration.get("task", {}), _units(task)
    for name, value in wants.items():
        if has.get(name) != value:
            raise UserError(f"{loaded.path}: made for task.{name}={has.get(name)}, expected {value:g}")
