"""Unknown kernels, the same everywhere or not: what neighbours within two px add."""

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.fit.camera.student import LeastSquares

_REACH = 2  # px
_SIDE = 2 * _REACH + 1
_OWN = _SIDE**2 // 2  # among a kernel's taps, row by row


def fit(residual: Tensor, mean: Tensor, weight: Tensor, waves: Tensor | None, near: np.ndarray | None) -> np.ndarray:
    """Coefficients of the taps, wave by wave where there are waves [W, H, W], for residuals about a mean [B, C, H, W].

    `near`: those of nearly the same residuals.
    """
    squares = LeastSquares(mean.shape, weight, _SIDE**2 - 1, waves)
    height, width = mean.shape[-2:]
    padded = F.pad(mean, (_REACH,) * 4, mode="replicate")
    row, x = squares.places // width, squares.places % width
    first = ((row // height) * padded.shape[-2] + row % height) * padded.shape[-1] + x
    flat, own = padded.reshape(-1), squares.at(mean)
    taps = (divmod(k, _SIDE) for k in range(_SIDE**2) if k != _OWN)
    return squares.solve(residual, (flat[first + (dy * padded.shape[-1] + dx)] - own for dy, dx in taps), near)


def added(mean: Tensor, coefficients: np.ndarray, waves: Tensor | None) -> Tensor:
    """What kernels of these coefficients add to a mean [B, C, H, W]."""
    taps = torch.from_numpy(coefficients).float().view(-1, _SIDE**2 - 1)
    kernels = torch.cat([taps[:, :_OWN], -taps.sum(1, keepdim=True), taps[:, _OWN:]], 1)
    padded = F.pad(mean, (_REACH,) * 4, mode="replicate").flatten(0, 1)[:, None]
    found = F.conv2d(padded, kernels.view(-1, 1, _SIDE, _SIDE))
    if waves is not None:
        found = (found * waves).sum(1, keepdim=True)
    return found.view_as(mean)
