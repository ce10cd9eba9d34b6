"""Frames that are mixed with those before them, by a filter against noise or charge that stays: what tells that.

Neither a grain nor a lamp knows what the last frame showed.
"""

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from vision_s2r.fit.camera.student import LeastSquares

MIXED = 0.5  # share of what is left in one light that the frame before takes away, from which light is not to blame
_LEAST_PIXELS = 400  # that tell anything
_SHARES = (0.2, 0.5)  # of the frame before in mixtures of light; those of other shares are about sums of these


def of_frame_before(residual: Tensor, mean: Tensor, counted: Tensor) -> float:
    """Share of residuals [N, C, H, W] that a part of the frame before, beside one of the frame itself, takes away.

    `counted` [N, 1, H, W]: the pixels that count.
    """
    values, own, before = (
        (each - each.mean((2, 3), keepdim=True))[1:][counted[1:].expand_as(mean[1:])].double()
        for each in (residual, mean, mean.roll(1, 0))
    )
    if len(values) < _LEAST_PIXELS:
        return 0.0
    other = before - own * (own @ before) / (own @ own).clamp(min=1e-12)
    return float((values @ other).square() / ((other @ other) * (values @ values)).clamp(min=1e-12))


def fit(residual: Tensor, mean: Tensor, weight: Tensor, before: Tensor) -> np.ndarray:
    """Coefficients of what frames have of those `before` them, for residuals about a mean, each [B, C, H, W]."""
    pictures = list(_mixed(mean, before))
    squares = LeastSquares(mean.shape, weight, len(pictures))
    return squares.solve(residual, map(squares.at, pictures))


def added(mean: Tensor, coefficients: np.ndarray, before: Tensor) -> Tensor:
    """What such a mixture adds to a mean [B, C, H, W]."""
    pictures = torch.stack(list(_mixed(mean, before)))
    return torch.tensordot(torch.from_numpy(coefficients).float(), pictures, 1)


def _mixed(mean: Tensor, before: Tensor) -> Iterator[Tensor]:
    """Of coded values, or of light, which is about their square: by how much a mixture of such a share is more."""
    yield before - mean
    for share in _SHARES:
        yield (mean.square() * (1 - share) + before.square() * share).sqrt() - mean
