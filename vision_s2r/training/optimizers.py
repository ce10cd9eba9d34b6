"""The optimizers of a network: AdamW, and Muon on the matrices that it is made for."""

from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch import Tensor, nn

from vision_s2r.training.config import TrainingConfig

KERNEL = "kernel"  # the last word of the names of parameters that Muon takes: matrices of hidden layers


def adamw(
    network: nn.Module, cfg: TrainingConfig, learning_rate: float | None = None, momentum: float = 0.9
) -> torch.optim.AdamW:
    """AdamW as the configuration has it; weight decay on matrices and kernels, not on biases and norms.

    `momentum`: of the gradient's mean; adversaries want less (Radford et al. 2016, arXiv:1511.06434: 0.5).
    """
    rate = cfg.learning_rate if learning_rate is None else learning_rate
    return _adamw(list(network.parameters()), cfg, rate, momentum)


def muon_and_adamw(network: nn.Module, cfg: TrainingConfig) -> torch.optim.Optimizer:
    """Muon (Jordan et al. 2024) on a network's kernels, AdamW on all else; AdamW alone where `cfg.muon` is 0."""
    if not cfg.muon:
        return adamw(network, cfg)
    kernels = [p for name, p in network.named_parameters() if name.rpartition(".")[2] == KERNEL]
    rest = [p for name, p in network.named_parameters() if name.rpartition(".")[2] != KERNEL]
    muon = torch.optim.Muon(kernels, lr=cfg.muon, weight_decay=cfg.weight_decay, adjust_lr_fn="match_rms_adamw")
    return Together(muon, _adamw(rest, cfg, cfg.learning_rate))


def _adamw(parameters: Iterable[Tensor], cfg: TrainingConfig, rate: float, momentum: float = 0.9) -> torch.optim.AdamW:
    parameters = list(parameters)
    groups = [
        {"params": [p for p in parameters if p.ndim >= 2], "weight_decay": cfg.weight_decay},
        {"params": [p for p in parameters if p.ndim < 2], "weight_decay": 0.0},
    ]
    return torch.optim.AdamW([g for g in groups if g["params"]], lr=rate, betas=(momentum, 0.999), fused=True)


class Together(torch.optim.Optimizer):
    """Several optimizers, each of parameters of its own, as one."""

    def __init__(self, *parts: torch.optim.Optimizer):
        self._parts = parts
        super().__init__([group for part in parts for group in part.param_groups], {})
        self._gather()

    def _gather(self) -> None:
        """The groups are the parts' own, so that a learning rate set here holds there."""
        self.param_groups = [group for part in self._parts for group in part.param_groups]

    @torch.no_grad()
    def step(self, closure: Callable[[], Any] | None = None) -> Any:
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        for part in self._parts:
            part.step()
        return loss

    def state_dict(self) -> dict[str, Any]:
        return {"parts": [part.state_dict() for part in self._parts]}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        for part, state in zip(self._parts, state_dict["parts"], strict=True):
            part.load_state_dict(state)
        self._gather()
