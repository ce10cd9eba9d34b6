"""The noise of flat fields, frame by frame and pixel by pixel, as photon transfer has it (EMVA 1288, release 4, 6.6).

What a pixel has in all frames, an offset and a gain of its own, is no noise in time: EMVA takes it out by differences
of two frames of one exposure, a weighted regression over all frames does the same for frames of any exposures.
"""

import numpy as np
import torch
from torch import Tensor

from vision_s2r.fit.camera.independent import likeness
from vision_s2r.fit.camera.smoothing import smoothed

EVEN = 1.5 / 255  # how much a flat field varies around a pixel at most …
_ALL_BUT = 0.99  # … in so many of its pixels
_LEAST = 5  # frames from which a pixel's own offset and gain are told
_WINDOW = 5  # px, whose mean is the light's
_ROUNDS, _STILL = 30, 1e-4  # of reweighting, and a change of variances that ends it: the darkest frame's come slowly
_FREE = 0.05  # of a frame's noise, that the regression has to leave: one frame alone in the dark tells its offset
_LAGS = ((0, 1), (1, 0), (1, 1), (0, 2), (2, 0))  # px
_ALIKE = 0.03  # correlation that rows' offsets, too small to matter, may have
_FAR, _FEW_FAR = 5.0, 1e-3  # standard deviations, and the share of pixels that are so far off at most
_CLIPPED = 0.01  # of a frame's values, that may lie at zero: what noise loses there lifts its mean
_STRAIGHT = 0.01  # of a frame's light, that a line through what is seen of each may miss it by
_SURE, _MOST = 3.0, 0.1  # standard deviations, and full scale: less than the one, or more than the other, is no black
_DIFFER = 1e-3  # standard deviation of the frames' brightness, from which a gain is told from an offset


def flat_fields(detail: Tensor, counted: Tensor) -> bool:
    """Whether pictures whose detail [N, 1, H, W] is given show nothing, where they count."""
    fine = detail[counted]
    few = fine[:: max(len(fine) // 100_000, 1)]
    return bool(len(few)) and float(few.quantile(_ALL_BUT)) < EVEN


def noise_of(residual: Tensor, mean: Tensor) -> Tensor:
    """Values [N, C, H, W] whose variance is the noise's, of residuals about flat fields of a `mean`."""
    fine = (residual - smoothed(residual, _WINDOW // 2)) / (1 - 1 / _WINDOW**2) ** 0.5
    if len(fine) < _LEAST:
        return fine
    level = mean.mean((1, 2, 3)).double()
    design = torch.ones(len(level), 1, dtype=torch.float64)
    if float(level.std()) > _DIFFER:
        design = torch.stack([torch.ones_like(level), level], 1)
    variance = fine.square().mean((1, 2, 3)).double().clamp(min=1e-12)
    for _ in range(_ROUNDS):
        weighed = design / variance[:, None]
        hat = design @ torch.linalg.inv(design.T @ weighed) @ weighed.T  # [N, N]
        left = fine - torch.tensordot(hat.float(), fine, 1)
        free = (1 - hat.diagonal()).float()[:, None, None, None]
        noise = torch.where(free > _FREE, left / free.clamp(min=_FREE).sqrt(), fine)
        before, variance = variance, noise.square().mean((1, 2, 3)).double().clamp(min=1e-12)
        if float((variance / before).log().abs().max()) < _STILL:
            break
    return noise


def is_white(noise: Tensor) -> bool:
    """Whether the noise of flat fields [N, C, H, W] is each pixel's own, as that of light and readout.

    Neighbors are as alike as the mean of the window that was taken off makes them, and few values lie far off: what
    moves over a scene, or is a row's, is no such noise.
    """
    if len(noise) < _LEAST:
        return False
    scaled = noise / noise.square().mean((2, 3), keepdim=True).sqrt().clamp(min=1e-9)
    every = torch.ones_like(scaled, dtype=torch.bool)
    own, share = 1 / _WINDOW**2, 1 - 1 / _WINDOW**2
    for dy, dx in _LAGS:
        expected = own * ((_WINDOW - dy) * (_WINDOW - dx) * own - 2) / share
        if abs(likeness(scaled, every, dy, dx) - expected) > _ALIKE:
            return False
    return float((scaled.abs() > _FAR).float().mean()) < _FEW_FAR


def black_level(seen: Tensor, light: Tensor, counted: Tensor, rounding: float) -> float:
    """What is under all values of flat fields, of full scale: light [N, C, H, W] as it is seen, and as it should be.

    It is what is left of a line through the frames' means where there is no light, and nothing where they lie on none:
    then exposures, or the curve of the values, are not as they should be. `rounding`: standard deviation of the light.
    """
    whole = ((seen < 1e-6) & counted).sum((1, 2, 3)) <= _CLIPPED * counted.sum((1, 2, 3)) * seen.shape[1]
    seen, light, counted = (each[whole] for each in (seen, light, counted))
    if len(seen) < _LEAST:
        return 0.0
    share = counted / counted.sum((1, 2, 3), keepdim=True).clamp(min=1) / seen.shape[1]
    y, x = ((each * share).sum((1, 2, 3)).double().numpy() for each in (seen, light))
    weight = 1 / np.sqrt((_STRAIGHT * y) ** 2 + rounding**2 + 1e-12)
    design = weight[:, None] * np.stack([x, np.ones_like(x)], 1)
    if np.ptp(x) < _DIFFER:
        return 0.0
    found = np.linalg.lstsq(design, weight * y, rcond=None)[0]
    misfit = float(((design @ found - weight * y) ** 2).sum()) / (len(y) - 2)
    error = float(np.sqrt(np.linalg.inv(design.T @ design)[1, 1] * misfit))
    black = float(found[1])
    return black if misfit < 1 and _SURE * error < black < _MOST else 0.0
