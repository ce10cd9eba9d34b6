"""What the training loop asks of a method: its networks, its optimizers and a handful of functions.

Everything a method returns (losses, metrics, pictures) is logged and saved without more code.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, ClassVar, Protocol

import torch
from torch import Tensor, nn

from vision_s2r.training.data import Draw, ViewSource

Batch = dict[str, Tensor]


class Step(Protocol):
    """What the loop hands to `Method.training_step`."""

    index: int  # 0 for the first
    progress: float  # part of the run that is done, [0, 1]
    # On the CPU, functions of (seed, step, rank) and of (seed, step): the only randomness of a step.
    generator: torch.Generator
    shared: torch.Generator

    def rows(self, count: int) -> tuple[int, Tensor]:
        """Samples of all ranks where each has `count`, and which are this rank's, int64 [count].

        A step whose draws are from `shared`, for all samples, and of which a rank takes its rows, is the same on any
        number of processes.
        """

    def optimize(self, loss: Tensor, *names: str) -> None:
        """One update of the networks `names` down the gradient of `loss`, a scalar.

        Clears their gradients, goes backward, averages over processes, clips, steps their optimizers. A loss
        that is a mean over its samples gives the same update on any number of processes.
        """


class Method(ABC):
    """Something to train.

    The constructor builds `networks` and `optimizers`: `optimizers[name]` trains `networks[name]`, a network
    without one stays as it is. It runs under the run's seed, on the CPU. The loop then wraps both for device
    and processes: look networks up in `self.networks` each time, and keep no reference of your own.
    """

    kind: ClassVar[str]  # of the released checkpoint: "translator", "q_function"
    networks: dict[str, nn.Module]
    optimizers: dict[str, torch.optim.Optimizer]
    released: tuple[str, ...]  # networks that go into the released checkpoint
    configuration: dict[str, Any]  # plain values: what rebuilds the networks, and all that shapes the run
    normalization: dict[str, Any]  # plain values: units and ranges of what goes in and comes out
    # Whether the networks begin as trained ones: they are validated before the first step, and released where no step
    # makes them better.
    fine_tunes: bool = False
    device: torch.device = torch.device("cpu")  # set by the loop before the first step

    @abstractmethod
    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        """The samples of one step, as the views hold them; called ahead of time in a thread of its own."""

    @abstractmethod
    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        """One step on `batch` (on the device), updates through `step.optimize`. Returns scalar losses."""

    @abstractmethod
    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        """Metrics over the validation views, by name.

        Runs in one process with networks in evaluation mode, in full precision and without gradients.
        `generator` (CPU) starts the same at each validation.
        """

    def pictures(self, views: ViewSource, generator: torch.Generator) -> dict[str, Tensor]:
        """Pictures to look at after a validation, by name: float [3, H, W] in [0, 1]; as `validate`."""
        return {}

    def state(self) -> dict[str, Any]:
        """Plain values: what later steps depend on besides networks, optimizers and configuration."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:  # noqa: B027 (most remember nothing)
        """Go on where `state` was taken; called on every process of a run that is resumed."""


@contextmanager
def frozen(*networks: nn.Module) -> Iterator[None]:
    """Within it, gradients flow through the networks but not into their weights (a GAN's generator step)."""
    try:
        for network in networks:
            network.requires_grad_(False)
        yield
    finally:
        for network in networks:
            network.requires_grad_(True)
