"""Means around pixels: what they share with their surroundings."""

import torch.nn.functional as F
from torch import Tensor


def smoothed(pictures: Tensor, reach: int = 1) -> Tensor:
    """The mean [B, C, H, W] of each pixel and its neighbours, of which there are `reach` to either side."""
    return F.avg_pool2d(F.pad(pictures, (reach,) * 4, mode="replicate"), 2 * reach + 1, 1)
