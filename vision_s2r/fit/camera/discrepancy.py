"""Flexible unknowns: smooth or free changes of a picture that no effect of the library is, linear in what they fit.

A camera that differs by something unknown would otherwise be told as whatever effects come near it.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.fit.camera import blurs, displacing, mixing
from vision_s2r.fit.camera.ghost import Ghost, find_ghost
from vision_s2r.fit.camera.smoothing import cosines, polynomials, smoothed
from vision_s2r.fit.camera.student import PASSES, LeastSquares, forgiving, left_by

DISCREPANCIES: dict[str, str] = {
    "tone_curve": "a smooth change of coded values",
    "colour_mixing": "channels that leak into each other",
    "gain_field": "a gain that varies smoothly over the picture",
    "added_light": "light added smoothly over the picture",
    "displacement": "a smooth displacement of the picture",
    "kernel": "a blur or sharpening of some other kernel",
    "kernel_field": "a blur or sharpening that grows from somewhere in the picture",
    "ghost": "a second copy of the picture, shifted or upside down",
    "glare": "light scattered far over the picture",
    "row_pattern": "rows and columns with offsets and gains of their own",
    "fixed_pattern": "pixels with offsets and gains of their own",
    "row_noise": "rows whose offsets and gains differ from frame to frame",
    "flicker": "a brightness that differs from frame to frame",
    "mixing": "frames that are mixed with those before them",
    "levels": "fewer levels than the values have bits for",
    "outliers": "single pixels that are far off",
}
IMITATING = {  # unknowns that may do the work of effects of a stage, which are as large wherever one looks
    "warp": frozenset({"displacement"}),
    "blur": frozenset({"kernel", "ghost", "glare"}),
    "light": frozenset({"tone_curve", "gain_field", "added_light", "flicker"}),
    "tone": frozenset({"tone_curve", "colour_mixing", "flicker"}),
}
LATENT = frozenset({"row_noise", "flicker"})  # what they fit is a frame's own
RANDOM = frozenset({"flicker", "outliers"})  # what they fit, or some of it, may be of anything that is random
SOON = frozenset({"tone_curve", "row_pattern", "row_noise", "fixed_pattern", "levels"})  # fitted in part of a second
_COLOUR = frozenset({"colour_mixing"})
_CODES, _USED, _SPREAD = 256, 0.7, 24  # of 8 bits; share of those in use that are no few; so many at least tell it
FEW = 0.05  # of the pixels: where more are far off, they are no outliers
_SCATTERED = (4, 10, 24)  # px, over which light is scattered
_AROUND = 7  # px to either side, whose mean is the light's and not the pixel's own
_RIDGE = 1e-3  # of the mean curvature: frames of one brightness tell no offset from a gain
_FLAT = 1e-5  # likewise: a row of one brightness
_SURELY = 3.0  # standard errors of a mean over frames, from which it is no frame's own
_BRIGHT = 0.7  # coded, from which a picture may be scattered by itself
_FIELDS = frozenset({"gain_field", "added_light"})
_COSINES = 5  # of these, along each axis
_KERNELS = frozenset({"kernel", "kernel_field"})


def available(grey: bool) -> dict[str, str]:
    """The discrepancies that mean something for colour or grey pictures, with what they are."""
    return {name: meaning for name, meaning in DISCREPANCIES.items() if not (grey and name in _COLOUR)}


def basis(name: str, mean: Tensor, ghost: Ghost | None = None, before: Tensor | None = None) -> Iterator[Tensor]:
    """What a discrepancy can add to a predicted mean [B, C, H, W]: pictures that broadcast to it, one a coefficient."""
    channels, height, width = mean.shape[1:]
    if name == "tone_curve":
        for knot in torch.linspace(0, 1, 11):
            yield (1 - (mean - knot).abs() * 10).clamp(min=0)
    elif name == "colour_mixing":
        for to in range(channels):
            only = torch.zeros(channels, 1, 1)
            only[to] = 1
            yield only.expand(1, channels, height, width)
            for source in range(channels):
                yield only * mean[:, source : source + 1]
    elif name == "glare":
        for reach in _SCATTERED:
            yield _scattered(mean, reach) - mean
            yield _scattered((mean - _BRIGHT).clamp(min=0), reach)
    elif name == "ghost":
        assert ghost is not None
        copy = ghost.of(mean)
        yield copy - mean
        yield copy
    elif name == "mixing":
        assert before is not None
        yield from mixing.mixtures(mean, before)
    else:
        raise ValueError(f"discrepancy '{name}' has no basis")


def _scattered(light: Tensor, reach: int) -> Tensor:
    """Blurred over about so many pixels: means of squares, and between their centres what lies between."""
    height, width = light.shape[-2:]
    coarse = F.interpolate(light, (max(height // reach, 1), max(width // reach, 1)), mode="area")
    return F.interpolate(coarse, (height, width), mode="bilinear")


@dataclass(frozen=True)
class FittedDiscrepancy:
    """A discrepancy's coefficients, or the picture [C, H, W] that it adds, or its share of outliers.

    Of patterns the offsets and gains [2, C, H, W]; of flicker and noise of rows those that are no frame's own.
    """

    coefficients: np.ndarray
    ghost: Ghost | None = None


Weights = Tensor  # [B, 1 or C, H, W], 0 where a pixel does not count


def fit(
    name: str,
    residual: Tensor,
    mean: Tensor,
    weight: Weights,
    near: FittedDiscrepancy | None = None,
    before: Tensor | None = None,
) -> FittedDiscrepancy:
    """The likeliest coefficients of a discrepancy for residuals [B, C, H, W] about a mean, single pixels forgiven.

    `near`: a fit to nearly the same, where there is one; `before`: the mean of the frames before these.
    """
    if name == "mixing":
        if before is None:
            return FittedDiscrepancy(np.zeros(0))
        return _combined(name, residual, mean, weight, None, before=before)
    if name in _PIXELS_OWN:
        found = _PIXELS_OWN[name](residual, mean, weight)
        for _ in range(PASSES - 1):
            left = residual - _of_pixels(found, mean)
            found = _PIXELS_OWN[name](residual, mean, weight * forgiving(left.square() * weight))
        return FittedDiscrepancy(found.numpy())
    if name == "outliers":
        distance = residual.square() * weight
        share = float((distance > 16).float().mean())
        return FittedDiscrepancy(np.array([min(max(share, 1e-6), FEW)]))
    if name == "levels":
        return FittedDiscrepancy(_levels((mean + residual)[(weight > 0).expand_as(mean)]))
    if name in LATENT:
        return FittedDiscrepancy(_common(_of_frames(name, residual, mean, weight), mean).numpy())
    begun = None if near is None else near.coefficients
    if name == "displacement":
        return FittedDiscrepancy(displacing.fit(residual, mean, weight, begun))
    if name in _KERNELS:
        return FittedDiscrepancy(blurs.fit(residual, mean, weight, _growing(name, mean), begun))
    if name in _FIELDS:
        squares = LeastSquares(mean.shape, weight, 1, cosines(*mean.shape[-2:], _COSINES))
        return FittedDiscrepancy(squares.solve(residual, [squares.at(_carrier(name, mean))], begun))
    if name == "ghost":
        counted = (weight.amax(1, keepdim=True) > 0).float()
        places = [find_ghost(residual, mean, counted), *([] if near is None else [near.ghost])]
        ghosts = [_combined(name, residual, mean, weight, None, each) for each in dict.fromkeys(places)]
        return min(ghosts, key=lambda each: left_by(residual - add(name, each, mean, residual, weight), weight))
    return _combined(name, residual, mean, weight, begun)


def _combined(
    name: str,
    residual: Tensor,
    mean: Tensor,
    weight: Weights,
    begun: np.ndarray | None,
    ghost: Ghost | None = None,
    before: Tensor | None = None,
) -> FittedDiscrepancy:
    pictures = list(basis(name, mean, ghost, before))
    squares = LeastSquares(mean.shape, weight, len(pictures))
    return FittedDiscrepancy(squares.solve(residual, map(squares.at, pictures), begun), ghost)


def _growing(name: str, mean: Tensor) -> Tensor | None:
    """What kernels are times: nothing, or what grows, without a part that is the same everywhere, as a blur's is."""
    return polynomials(*mean.shape[-2:])[1:] if name == "kernel_field" else None


def _carrier(name: str, mean: Tensor) -> Tensor:
    """What a smooth field multiplies."""
    return mean if name == "gain_field" else torch.ones(1, 1, *mean.shape[-2:])


def add(
    name: str,
    fitted: FittedDiscrepancy,
    mean: Tensor,
    residual: Tensor,
    weight: Weights,
    before: Tensor | None = None,
) -> Tensor:
    """What the discrepancy adds to a mean [B, C, H, W]; `residual` is for those whose unknowns are a frame's own.

    `before`: the mean of the frames before these, for those that are mixed with them.
    """
    if name in _PIXELS_OWN:
        return _of_pixels(torch.from_numpy(fitted.coefficients), mean)
    if name == "outliers" or not fitted.coefficients.size:
        return torch.zeros_like(mean)
    if name == "levels":
        levels = torch.from_numpy(fitted.coefficients).float()
        return levels[torch.bucketize(mean.contiguous(), (levels[1:] + levels[:-1]) / 2)] - mean
    if name in LATENT:
        own = _of_frames(name, residual, mean, weight) - torch.from_numpy(fitted.coefficients)
        return (own[0] + own[1] * mean).float()
    if name == "displacement":
        return displacing.displaced(mean, fitted.coefficients) - mean
    if name in _KERNELS:
        return blurs.added(mean, fitted.coefficients, _growing(name, mean))
    if name in _FIELDS:
        field = torch.tensordot(torch.from_numpy(fitted.coefficients).float(), cosines(*mean.shape[-2:], _COSINES), 1)
        return (_carrier(name, mean) * field).expand_as(mean)
    added = torch.zeros_like(mean)
    for coefficient, wave in zip(fitted.coefficients.tolist(), basis(name, mean, fitted.ghost, before), strict=True):
        added += coefficient * wave
    return added


def told_by(kinds: Collection[str], residual: Tensor, mean: Tensor, weight: Weights) -> dict[str, float]:
    """The share of residuals [B, C, H, W] that an unknown of each of these kinds takes away.

    What it has of its own is that of the other half of the frames: of few, single pixels would fit anything.
    """
    whole = (weight * residual.square()).double().sum().clamp(min=1e-12)
    even, odd, every = slice(0, None, 2), slice(1, None, 2), slice(None)
    parts = ((even, odd), (odd, even)) if len(residual) > 1 else ((every, every),)

    def taken(name: str) -> float:
        left = 0.0
        for known, asked in parts:
            fitted = fit(name, residual[known], mean[known], weight[known])
            added = add(name, fitted, mean[asked], residual[asked], weight[asked])
            left += float((weight[asked] * (residual[asked] - added).square()).double().sum())
        return float(1 - left / whole)

    return {name: taken(name) for name in kinds}


def _affine(residual: Tensor, mean: Tensor, weight: Weights, over: tuple[int, ...]) -> Tensor:
    """The offset and gain [2, …], each sum over these axes of pictures [B, C, H, W] one value, that residuals have.

    Coded values grow with light by a factor, above a pedestal.
    """
    weight = weight.expand_as(residual)

    def summed(values: Tensor) -> Tensor:
        return (values * weight).double().sum(over, keepdim=True)

    ones, across, squares = weight.double().sum(over, keepdim=True), summed(mean), summed(mean.square())
    ridge = _FLAT * (ones + squares) / 2 + 1e-12
    ones, squares = ones + ridge, squares + ridge
    offset, gain = summed(residual), summed(mean * residual)
    found = torch.stack([squares * offset - across * gain, ones * gain - across * offset])
    return found / (ones * squares - across.square())


def _common(found: Tensor, mean: Tensor) -> Tensor:
    """The offset and gain [2, 1, …] that frames of these [2, B, …] have in common: none where that may be by chance."""
    level = found[0] + found[1] * mean.double().mean()
    if len(level) < 2:
        return torch.zeros_like(found[:, :1])
    surely = level.mean(0).abs() > _SURELY * level.std(0) / len(level) ** 0.5
    return (found.mean(1) * surely)[:, None]


def _of_frames(name: str, residual: Tensor, mean: Tensor, weight: Weights) -> Tensor:
    """The offset and gain [2, B, 1, 1 or H, 1] of each frame, or of its rows beside its own."""
    if name == "flicker":
        return _affine(residual, mean, weight, (1, 2, 3))
    total = weight.expand_as(residual).double().sum((1, 3), keepdim=True)
    rows = _affine(residual, mean, weight, (1, 3))
    frame = (rows * total).sum(3, keepdim=True) / total.sum(2, keepdim=True).clamp(min=1e-12)
    return (rows - frame) * (total > 0)


def _levels(values: Tensor) -> np.ndarray:
    """The levels that values have, from the lowest to the highest; none where they have most of those of their bits."""
    counts = torch.bincount((values * (_CODES - 1)).round().long().clamp(0, _CODES - 1), minlength=_CODES)
    used = (counts > 1e-4 * len(values)).nonzero()[:, 0]
    if len(used) < 2 or int(used[-1] - used[0]) < _SPREAD or len(used) > _USED * int(used[-1] - used[0] + 1):
        return np.empty(0)
    return (used.double() / (_CODES - 1)).numpy()


def _offsets_and_gains(residual: Tensor, mean: Tensor, weight: Weights) -> Tensor:
    """An offset and a gain of each pixel [2, C, H, W], the same in every frame, apart from what neighbours share.

    Least squares, shrunk as pixels' own offsets and gains are found to spread (Efron and Morris 1973).
    """
    weight = weight.expand_as(residual)
    design = torch.stack([torch.ones_like(mean), mean])  # [2, B, C, H, W]
    matrix = torch.einsum("ibchw,jbchw,bchw->chwij", design, design, weight)
    vector = torch.einsum("ibchw,bchw,bchw->chwi", design, residual, weight)
    seen = weight.sum(0) > 0
    if not seen.any():
        return torch.zeros_like(design[:, 0])
    covariance = torch.linalg.inv(matrix + _RIDGE * matrix[seen].mean(0).diagonal().diag())
    found = _own((covariance @ vector[..., None])[..., 0])
    left = residual - (design * found.movedim(-1, 0)[:, None]).sum(0)
    free = max(len(residual) - 2, 1) / len(residual)
    covariance *= (left.square() * weight)[:, seen].mean() / free  # weights may not be those of the noise
    spread = (found[..., :, None] * found[..., None, :] - covariance)[seen].mean(0)
    size, axes = torch.linalg.eigh(spread)
    spread = axes @ size.clamp(min=0).diag() @ axes.T
    shrunk = spread @ torch.linalg.solve(spread + covariance, found[..., None])
    return shrunk[..., 0].movedim(-1, 0)


def _own(values: Tensor) -> Tensor:
    """What pixels have [C, H, W, K] beside their surroundings."""
    pictures = values.movedim(-1, 0)
    return (pictures - smoothed(pictures, _AROUND)).movedim(0, -1)


def _rows_and_columns(residual: Tensor, mean: Tensor, weight: Weights) -> Tensor:
    """Offsets and gains of rows and columns together [2, C, H, W], the same in every frame."""
    rows = _beside_a_trend(_affine(residual, mean, weight, (0, 3)), 3)
    columns = _beside_a_trend(_affine(residual - (rows[0] + rows[1] * mean), mean, weight, (0, 2)), 4)
    return (rows + columns)[:, 0].float()


def _beside_a_trend(values: Tensor, axis: int) -> Tensor:
    """Values without their slope and bend along an axis, where they surely have any: that is light that falls off."""
    place = torch.linspace(-1, 1, values.shape[axis], dtype=values.dtype)
    slope, bend = place / place.norm(), place.square() - place.square().mean()
    found = values.movedim(axis, -1)
    for wave in (slope, bend / bend.norm()):
        size = (found @ wave)[..., None]
        less = found - size * wave
        found = torch.where(size.abs() > _SURELY * less.std(-1, keepdim=True), less, found)
    return found.movedim(-1, axis)


_PIXELS_OWN = {"row_pattern": _rows_and_columns, "fixed_pattern": _offsets_and_gains}  # the same in every frame


def _of_pixels(fitted: Tensor, mean: Tensor) -> Tensor:
    return fitted[0] + fitted[1] * mean
