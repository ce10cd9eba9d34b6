"""Unknown kernels, the same everywhere or not: what neighbours within two px add."""

import numpy as np
import torch
import torch.nn.functional as F
from numba import njit
from torch import Tensor

from vision_s2r.fit.camera.student import LeastSquares

_REACH = 2  # px
_SIDE = 2 * _REACH + 1
_NEIGHBOURS = [divmod(k, _SIDE) for k in range(_SIDE**2) if k != _SIDE**2 // 2]  # rows and columns of a kernel's taps


def fit(residual: Tensor, mean: Tensor, weight: Tensor, waves: Tensor | None, near: np.ndarray | None) -> np.ndarray:
    """Coefficients of the taps, wave by wave where there are waves [W, H, W], for residuals about a mean [B, C, H, W].

    `near`: those of nearly the same residuals.
    """
    squares = LeastSquares(mean.shape, weight, len(_NEIGHBOURS), waves)
    height, width = mean.shape[-2:]
    padded = F.pad(mean, (_REACH,) * 4, mode="replicate")
    row, x = squares.places // width, squares.places % width
    first = ((row // height) * padded.shape[-2] + row % height) * padded.shape[-1] + x
    flat, own = padded.reshape(-1), squares.at(mean)
    around = (flat[first + (dy * padded.shape[-1] + dx)] - own for dy, dx in _NEIGHBOURS)
    return squares.solve(residual, around, near)


def added(mean: Tensor, coefficients: np.ndarray, waves: Tensor | None) -> Tensor:
    """What kernels of these coefficients add to a mean [B, C, H, W]."""
    taps = coefficients.reshape(-1, len(_NEIGHBOURS)).astype(np.float32)
    grown = torch.ones(1, *mean.shape[-2:]) if waves is None else waves
    padded = F.pad(mean, (_REACH,) * 4, mode="replicate").flatten(0, 1)
    places = [(dy - _REACH) * padded.shape[-1] + dx - _REACH for dy, dx in _NEIGHBOURS]
    found = _added(padded.numpy(), taps, np.array(places).astype(np.uint64), grown.contiguous().numpy())
    return torch.from_numpy(found).view_as(mean)


@njit(nogil=True, cache=True, fastmath=True)
def _added(padded, taps, places, waves):  # type: ignore[no-untyped-def]
    """Row by row, so that a row's kernels serve all planes; `places` [T] are those of taps from a pixel's own on.

    Flat and by unsigned indices, and a sum is written once for four taps: else it would take most of the time.
    """
    height, width = waves.shape[1:]
    planes, across = len(padded), padded.shape[2]
    values, found = padded.reshape(-1), np.zeros((planes, height, width), np.float32)
    kernels, to = np.empty((taps.shape[1], width), np.float32), found.reshape(-1)
    for i in range(height):
        kernels[:] = 0
        for t in range(len(kernels)):
            for w in range(len(waves)):
                for j in range(width):
                    kernels[t, j] += taps[w, t] * waves[w, i, j]
        for p in range(planes):
            at = np.uint64((p * height + i) * width)
            own = np.uint64((p * padded.shape[1] + i + _REACH) * across + _REACH)
            for t in range(0, len(kernels), 4):
                one, two, three, four = kernels[t], kernels[t + 1], kernels[t + 2], kernels[t + 3]
                a, b, c, d = own + places[t], own + places[t + 1], own + places[t + 2], own + places[t + 3]
                for j in range(width):
                    q = np.uint64(j)
                    to[at + q] += (
                        one[q] * (values[a + q] - values[own + q])
                        + two[q] * (values[b + q] - values[own + q])
                        + three[q] * (values[c + q] - values[own + q])
                        + four[q] * (values[d + q] - values[own + q])
                    )
    return found
