"""What is smooth: means around pixels, which they share with their surroundings, and waves over the picture."""

from functools import lru_cache

import torch
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


@lru_cache(maxsize=8)
def polynomials(height: int, width: int) -> Tensor:
    """Polynomials [6, H, W] in the place, up to the second order; the first is the same everywhere."""
    y = torch.linspace(-1, 1, height)[:, None].expand(height, width)
    x = torch.linspace(-1, 1, width).expand(height, width)
    return torch.stack([torch.ones_like(x), x, y, x * x, x * y, y * y])


@lru_cache(maxsize=4)
def cosines(height: int, width: int, count: int) -> Tensor:
    """Products of cosines [count², H, W], the smoothest first along each axis."""

    def axis(size: int) -> Tensor:
        position = (torch.arange(size) + 0.5) / size
        return torch.cos(torch.pi * torch.arange(count)[:, None] * position)

    return (axis(height)[:, None, :, None] * axis(width)[None, :, None, :]).reshape(count * count, height, width)
