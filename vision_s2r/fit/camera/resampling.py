"""Warps under the kernels that cameras' optics and other simulators may have: which one is no part of an effect."""

from functools import cache

import numpy as np
import torch
from numba import njit
from torch import Tensor

KERNELS = ("cubic -0.75", "cubic -0.5", "lanczos", "bilinear")  # Keys' cubic of two bends, Lanczos with three lobes
_REACH = {"cubic -0.75": 2, "cubic -0.5": 2, "lanczos": 3, "bilinear": 1}  # px
_PHASES = 1024  # between two pixels, at which weights are known: what lies between these is interpolated


def resampled(pictures: Tensor, x: Tensor, y: Tensor, kernel: str) -> Tensor:
    """Pictures [B, C, H, W] at positions `x`, `y` [1 or C, H, W], px, under one of `KERNELS`; edges repeat."""
    count, channels, height, width = pictures.shape
    x_at, y_at = (np.ascontiguousarray(each.numpy(), np.float32) for each in (x, y))
    # What shares a map lies side by side [maps, H, W, planes], so that a weight serves many values.
    planes = pictures.transpose(0, 1).reshape(len(x_at), -1, height, width).permute(0, 2, 3, 1).contiguous().numpy()
    found = np.empty(planes.shape, np.float32)
    _resample(planes, x_at, y_at, _weights(kernel), found)
    moved = torch.from_numpy(found).permute(0, 3, 1, 2).reshape(channels, count, height, width)
    return moved.transpose(0, 1).contiguous()


@cache
def _weights(kernel: str) -> np.ndarray:
    """The weights [phases + 1, taps] of the pixels about a position so far beyond the one before it; their sum is 1."""
    reach = _REACH[kernel]
    taps = np.arange(1 - reach, 1 + reach)
    d = np.abs(np.linspace(0, 1, _PHASES + 1)[:, None] - taps)
    if kernel == "bilinear":
        weights = np.maximum(1 - d, 0)
    elif kernel == "lanczos":
        weights = np.where(d < 3, np.sinc(d) * np.sinc(d / 3), 0)
    else:
        bend = float(kernel.split()[1])
        inner = ((bend + 2) * d - (bend + 3)) * d * d + 1
        weights = np.where(d <= 1, inner, np.where(d < 2, bend * (((d - 5) * d + 8) * d - 4), 0))
    return np.asarray(weights / weights.sum(1, keepdims=True), np.float32)


@njit(nogil=True, cache=True, fastmath=True)
def _resample(planes, x, y, weights, found):  # type: ignore[no-untyped-def]
    """Flat and by unsigned indices: views of rows, and looking for indices below 0, would take most of the time."""
    maps, height, width, count = planes.shape
    phases, taps = len(weights) - 1, weights.shape[1]
    across, down = np.empty(taps, np.float32), np.empty(taps, np.float32)
    columns, rows = np.empty(taps, np.int64), np.empty(taps, np.int64)
    for m in range(maps):
        values, to = planes[m].reshape(-1), found[m].reshape(-1)
        at = np.uint64(0)
        for i in range(x.shape[1]):
            for j in range(x.shape[2]):
                _taps(x[m, i, j], width, weights, phases, taps, across, columns)
                _taps(y[m, i, j], height, weights, phases, taps, down, rows)
                for p in range(count):
                    to[at + np.uint64(p)] = 0
                for r in range(taps):
                    for k in range(0, taps, 2):  # a sum is written once for two taps
                        one, other = down[r] * across[k], down[r] * across[k + 1]
                        a = np.uint64(count * (rows[r] * width + columns[k]))
                        b = np.uint64(count * (rows[r] * width + columns[k + 1]))
                        for p in range(count):
                            q = np.uint64(p)
                            to[at + q] += one * values[a + q] + other * values[b + q]
                at += np.uint64(count)


@njit(nogil=True, cache=True, fastmath=True, inline="always")
def _taps(position, size, weights, phases, taps, own, indices):  # type: ignore[no-untyped-def]
    """The weights, and the pixels that they are of, of one position along one axis."""
    first = np.int64(np.floor(position))
    phase = (position - first) * phases
    below = min(np.int64(phase), phases - 1)
    part = np.float32(phase - below)
    for k in range(taps):
        own[k] = weights[below, k] + part * (weights[below + 1, k] - weights[below, k])
        indices[k] = min(max(first + k + 1 - taps // 2, 0), size - 1)
