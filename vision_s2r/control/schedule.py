"""The learning rate over a training."""

import math

import torch

from vision_s2r.control.config import LEAST_RATE


def fall(optimizer: torch.optim.Optimizer, highest: float, done: float) -> None:
    """Set the learning rate for when a share of the steps is `done`: half a cosine from the highest on."""
    for group in optimizer.param_groups:
        group["lr"] = highest * max(LEAST_RATE, 0.5 * (1 + math.cos(math.pi * done)))
