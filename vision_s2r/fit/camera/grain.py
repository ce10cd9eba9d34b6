"""Grain that a render lacks: what is left of a label, if it is a random field as a surface's is.

Its strength and correlation length are those of the autocovariance of what is left, without that at no distance, where
the camera's noise is. A blur, a shift or a missing thing leave something too: in few places, where the render has
detail, or along one direction.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera.colour import Curve
from vision_s2r.fit.camera.prediction import linear
from vision_s2r.fit.camera.smoothing import smoothed

_INSIDE = 2  # px from other labels: what is left nearer is of edges
_REACH = 24  # px, of the autocovariance
_LEAST_PIXELS = 400  # of a label
_LEAST_SPREAD = 0.8 / 255  # coded, that a surface's grain has to have
_FALLEN = 0.25  # of the autocovariance at one px: as far as it is fitted
_TOP, _CONCENTRATED = 0.05, 0.5  # share of the pixels; share of the squares that is in them, if they are few places
_AT_DETAIL = 4.0  # times the squares in the quarter of pixels of most detail as in that of least: of a grain about one
_PASSES = 3  # of what a frame's mean takes, which depends on the grain
TOLD = 0.1  # share of what is left that something tells, the frame before or an unknown, from which it is no grain
OF_ROWS = 0.3  # likewise of rows with offsets of a frame's own, which tell something of any grain, more of a coarse one
_ROUND = 3.0  # times as far correlated along one axis as along the other, that no grain is


@dataclass(frozen=True)
class Grain:
    """Standard deviation over mean of linear light, and the distance (px) at which the correlation falls to 1/e."""

    amplitude: float
    scale: float


def per_share(mean: Tensor, curve: Curve) -> Tensor:
    """How far coded values [B, C, H, W] change for a change of their light by its own size."""
    if curve == "linear":
        return mean.clamp(min=0.0)
    step = 1e-3
    light = linear(mean.clamp(0, 1), curve)
    slope = (linear(mean.clamp(0, 1) + step, curve) - light) / step
    return light / slope.clamp(min=1e-6)


def grain_of(residual: Tensor, mean: Tensor, region: Tensor, counted: Tensor, curve: Curve) -> Grain | None:
    """The grain that residuals [B, C, H, W] about a mean show on a label; None where they show none.

    `region` [B, 1, H, W] is the label's share of each pixel, `counted` [B, 1, H, W] the pixels that count.
    """
    outside = F.max_pool2d(1 - region, 2 * _INSIDE + 1, 1, _INSIDE)
    share = per_share(mean, curve).mean(1)
    seen = ((outside < 0.5) & counted)[:, 0] & (share > 0.02)
    size = seen.sum((1, 2))
    frames = (size > _LEAST_PIXELS / 4).nonzero()[:, 0]
    if int(size[frames].sum()) < _LEAST_PIXELS:
        return None
    mask = seen[frames].float()
    values = residual[frames].mean(1) / share[frames].clamp(min=0.02)
    values = (values - ((values * mask).sum((1, 2)) / mask.sum((1, 2)))[:, None, None]) * mask
    covariance, weight = _autocovariance(values, mask)
    found = _fitted(covariance, weight)
    for _ in range(_PASSES):
        if found is None:
            break
        # A frame's own mean has taken so much of it, at every distance.
        taken = min(np.pi * found.scale**2 / float(size[frames].float().mean()), 0.5) * found.amplitude**2
        found = _fitted(covariance + taken, weight) or found
    if found is None or found.amplitude * float(share[seen].mean()) < _LEAST_SPREAD:
        return None
    return None if _in_few_places(values, mask) or _at_detail(values, mask, mean[frames]) else found


def _autocovariance(values: Tensor, mask: Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Of values [B, H, W] where seen: [2 reach + 1, 2 reach + 1] about no shift, and how many pairs each is of."""
    height, width = values.shape[-2:]
    reach = min(_REACH, height // 2, width // 2)
    shape = (height + reach, width + reach)

    def correlated(pictures: Tensor) -> Tensor:
        power = torch.fft.rfft2(pictures, s=shape).abs().square().sum(0)
        whole = torch.fft.irfft2(power, s=shape)
        return torch.roll(whole, (reach, reach), (0, 1))[: 2 * reach + 1, : 2 * reach + 1]

    pairs = correlated(mask).clamp(min=0.5)
    return (correlated(values) / pairs).double().numpy(), pairs.double().numpy()


def _fitted(covariance: np.ndarray, pairs: np.ndarray) -> Grain | None:
    """Strength and length of a Gaussian correlation."""
    reach = len(covariance) // 2
    offset = np.arange(-reach, reach + 1)
    distance = np.hypot(offset[:, None], offset)
    rings = [np.abs(distance - lag) < 0.5 for lag in range(1, reach + 1)]
    level, far = (
        np.array([np.average(each[ring], weights=pairs[ring]) for ring in rings]) for each in (covariance, distance**2)
    )
    if level[0] <= 0:
        return None
    below = np.flatnonzero(level < _FALLEN * level[0])
    end = int(below[0]) if len(below) else len(rings)
    if end < 2:  # it falls within two pixels: as far as those two say
        end = 2
    if (level[:end] <= 0).any():
        return None
    slope = np.polyfit(far[:end], np.log(level[:end]), 1, w=np.sqrt(level[:end]))[0]
    if slope >= 0:
        return None
    bend = np.log(level[0] / level[1]) / (far[1] - far[0])  # there, whatever its form further off
    at_none = np.log(level[0]) + bend * far[0]
    scale = float(np.sqrt(-1 / slope))
    at = int(np.clip(round(scale / 2), 1, reach))
    across, down = covariance[reach, reach + at], covariance[reach + at, reach]
    round_enough = min(across, down) * _ROUND > max(across, down) > 0
    return Grain(float(np.exp(at_none / 2)), scale) if round_enough and scale < reach else None


def _in_few_places(values: Tensor, mask: Tensor) -> bool:
    """Whether most of what is left is in few pixels of the label."""
    squares = values[mask > 0].square()
    top = squares.topk(max(int(_TOP * len(squares)), 1)).values.sum()
    return float(top / squares.sum().clamp(min=1e-12)) > _CONCENTRATED


def _at_detail(values: Tensor, mask: Tensor, mean: Tensor) -> bool:
    """Whether what is left is where the render has detail, as what a filter leaves is: a grain is everywhere."""
    grey = mean.mean(1, keepdim=True)
    detail = smoothed((grey - smoothed(grey)).square(), _INSIDE)[:, 0][mask > 0]
    squares = values[mask > 0].square()[detail.argsort()]
    quarter = len(squares) // 4
    return float(squares[-quarter:].mean()) > _AT_DETAIL * float(squares[:quarter].mean())


@dataclass(frozen=True)
class Varied:
    """What a frame's label is predicted to vary by."""

    variance: Tensor  # [1, C, H, W] of coded values, 0 outside the label
    area: float  # px that vary together


def matched(squared: Tensor, floor: Tensor, varied: Sequence[Varied], counted: Tensor) -> Tensor:
    """Squared residuals [1, C, H, W] where grain is predicted.

    One grain never matches another: beside the floor remains the squared difference of their standard deviations, less
    what so large a piece of the same grain differs from another by.
    """
    for each in varied:
        own = (each.variance > 0) & counted.expand_as(each.variance)
        if own.any():
            left, least = squared[own].mean(), floor.expand_as(squared)[own].mean()
            predicted = each.variance[own].mean()
            spread = ((left - least).clamp(min=0).sqrt() - predicted.sqrt()).square()
            pieces = max(float(own.sum()) / own.shape[1] / each.area, 1.0)
            spread = (spread - predicted / (2 * pieces)).clamp(min=0)
            squared = torch.where(own, squared * (least + spread) / left.clamp(min=1e-12), squared)
    return squared
