"""An unknown displacement: smooth, the same in every frame, and of many pixels where it has to be."""

import numpy as np
import torch
from torch import Tensor

from vision_s2r.fit.camera.resampling import KERNELS, resampled
from vision_s2r.fit.camera.smoothing import cosines, smoothed
from vision_s2r.fit.camera.student import LeastSquares, left_by

_COSINES = 6  # along each axis
_TO_FINE = (4, 4, 2, 1, 0, 0)  # px to either side, over whose means it is fitted, step by step


def fit(residual: Tensor, mean: Tensor, weight: Tensor, near: np.ndarray | None) -> np.ndarray:
    """Its coefficients, x and y of each wave, for residuals about a mean [B, C, H, W]; none where that helps nothing.

    From coarse to fine, in steps that are linear in what is still to be moved (Lucas and Kanade 1981). `near`: that of
    nearly the same residuals.
    """
    real, waves = mean + residual, cosines(*mean.shape[-2:], _COSINES)
    found = np.zeros(2 * len(waves)) if near is None else near
    squares = LeastSquares(mean.shape, weight, 2, waves)
    for reach in _TO_FINE if near is None else _TO_FINE[-1:]:
        moved = displaced(mean, found)
        seen, left = (smoothed(each, reach) if reach else each for each in (moved, real - moved))
        slopes = torch.gradient(seen, dim=(-1, -2))
        found = found + squares.solve(left, map(squares.at, slopes))
    helps = left_by(real - displaced(mean, found), weight) < left_by(residual, weight)
    return found if helps else 0 * found


def displaced(mean: Tensor, coefficients: np.ndarray) -> Tensor:
    """Pictures [B, C, H, W], looked up where a displacement of these coefficients says."""
    height, width = mean.shape[-2:]
    by_wave = torch.from_numpy(coefficients).float().view(-1, 2)
    across, down = torch.tensordot(by_wave.T, cosines(height, width, _COSINES), 1)
    x, y = torch.arange(width) + across, torch.arange(height)[:, None] + down
    return resampled(mean, x[None], y[None], KERNELS[1])
