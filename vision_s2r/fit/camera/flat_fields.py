"""The noise of flat fields, frame by frame and pixel by pixel, as photon transfer has it (EMVA 1288, release 4, 6.6).

What a pixel has in all frames, an offset and a gain of its own, is no noise in time: EMVA takes it out by differences
of two frames of one exposure, a weighted regression over all frames does the same for frames of any exposures.
"""

import torch
import torch.nn.functional as F
from torch import Tensor

EVEN = 1.5 / 255  # how much a flat field varies around a pixel at most …
_ALL_BUT = 0.99  # … in so many of its pixels
_LEAST = 5  # frames from which a pixel's own offset and gain are told
_WINDOW = 5  # px, whose mean is the light's
_ROUNDS = 3  # of reweighting
_DIFFER = 1e-3  # standard deviation of the frames' brightness, from which a gain is told from an offset


def flat_fields(detail: Tensor, counted: Tensor) -> bool:
    """Whether pictures whose detail [N, 1, H, W] is given show nothing, where they count."""
    fine = detail[counted]
    few = fine[:: max(len(fine) // 100_000, 1)]
    return bool(len(few)) and float(few.quantile(_ALL_BUT)) < EVEN


def squared_noise(residual: Tensor, mean: Tensor) -> Tensor:
    """Squares [N, C, H, W] whose expectation is the noise's variance, of residuals about flat fields of a `mean`."""
    window = F.avg_pool2d(F.pad(residual, (_WINDOW // 2,) * 4, mode="replicate"), _WINDOW, 1)
    fine = (residual - window) / (1 - 1 / _WINDOW**2) ** 0.5
    if len(fine) < _LEAST:
        return fine.square()
    level = mean.mean((1, 2, 3)).double()
    design = torch.ones(len(level), 1, dtype=torch.float64)
    if float(level.std()) > _DIFFER:
        design = torch.stack([torch.ones_like(level), level], 1)
    variance = fine.square().mean((1, 2, 3)).double().clamp(min=1e-12)
    for _ in range(_ROUNDS):
        weighed = design / variance[:, None]
        hat = design @ torch.linalg.inv(design.T @ weighed) @ weighed.T  # [N, N]
        left = fine - torch.tensordot(hat.float(), fine, 1)
        squared = left.square() / (1 - hat.diagonal()).float()[:, None, None, None]
        variance = squared.mean((1, 2, 3)).double().clamp(min=1e-12)
    return squared
