"""Means around pixels: what they share with their surroundings."""

import torch.nn.functional as F
from torch import Tensor


def smoothed(pictures: Tensor, reach: int = 1) -> Tensor:
    """The mean [B, C, H, W] of each pixel and its neighbours, of which there are `reach` to either side."""
    window = 2 * reach + 1
    mean = F.pad(pictures, (reach,) * 4, mode="replicate")
    for axis in (-2, -1):  # pooling sums the whole window for each pixel
        size = mean.shape[axis] - 2 * reach
        total = mean.narrow(axis, 0, size).clone()
        for k in range(1, window):
            total += mean.narrow(axis, k, size)
        mean = total
    return mean.div_(window**2)
