"""Warps under the kernels that cameras' optics and other simulators may have: which one is no part of an effect."""

import math

import numpy as np
import torch
from numba import njit
from torch import Tensor

KERNELS = ("cubic -0.75", "cubic -0.5", "lanczos", "bilinear")  # Keys' cubic of two bends, Lanczos with three lobes
_REACH = (2, 2, 3, 1)  # px


def resampled(pictures: Tensor, x: Tensor, y: Tensor, kernel: str) -> Tensor:
    """Pictures [B, C, H, W] at positions `x`, `y` [1 or C, H, W], px, under one of `KERNELS`; edges repeat."""
    index = KERNELS.index(kernel)
    found = np.empty(pictures.shape, np.float32)
    planes, x_at, y_at = (np.ascontiguousarray(each.numpy(), np.float32) for each in (pictures, x, y))
    _resample(planes, x_at, y_at, index, _REACH[index], found)
    return torch.from_numpy(found)


@njit(nogil=True, cache=True)
def _weight(distance: float, kernel: int) -> float:
    d = abs(distance)
    if kernel == 3:
        return max(1.0 - d, 0.0)
    if kernel == 2:
        if d < 1e-6:
            return 1.0
        if d >= 3:
            return 0.0
        turn = math.pi * d
        return 3.0 * math.sin(turn) * math.sin(turn / 3) / (turn * turn)
    bend = -0.75 if kernel == 0 else -0.5
    if d <= 1:
        return ((bend + 2) * d - (bend + 3)) * d * d + 1
    return bend * (((d - 5) * d + 8) * d - 4) if d < 2 else 0.0


@njit(nogil=True, cache=True)
def _resample(pictures, x, y, kernel, reach, found):  # type: ignore[no-untyped-def]
    count, channels, height, width = pictures.shape
    taps = 2 * reach
    across, down = np.empty(taps, np.float32), np.empty(taps, np.float32)
    columns, rows = np.empty(taps, np.int64), np.empty(taps, np.int64)
    each = channels // len(x)  # channels that share a map
    for m in range(len(x)):
        for i in range(x.shape[1]):
            for j in range(x.shape[2]):
                left, top = math.floor(x[m, i, j]), math.floor(y[m, i, j])
                sum_x, sum_y = 0.0, 0.0
                for k in range(taps):
                    column, row = left + 1 - reach + k, top + 1 - reach + k
                    across[k], down[k] = _weight(x[m, i, j] - column, kernel), _weight(y[m, i, j] - row, kernel)
                    sum_x += across[k]
                    sum_y += down[k]
                    columns[k], rows[k] = min(max(column, 0), width - 1), min(max(row, 0), height - 1)
                scale = 1.0 / (sum_x * sum_y)
                for b in range(count):
                    for c in range(m * each, (m + 1) * each):
                        value = 0.0
                        for r in range(taps):
                            line = 0.0
                            for k in range(taps):
                                line += across[k] * pictures[b, c, rows[r], columns[k]]
                            value += down[r] * line
                        found[b, c, i, j] = value * scale
