"""How well a hypothesis predicts each frame: likelihood by blocks, excess over the noise, and the gap's metric."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.fit.camera.codec import CodecScatter
from vision_s2r.fit.camera.discrepancy import FEW
from vision_s2r.fit.camera.grain import Varied, matched
from vision_s2r.fit.camera.student import FREEDOM
from vision_s2r.fit.camera.weighing import LEAST, NoiseModel

BLOCK = 8  # px: within it residuals depend on each other
_PRICE = 0.05  # excess over the floor that flexible unknowns must take away before they say anything
_CELLS = 4  # along each axis, that a frame's likelihood is divided into


@dataclass(frozen=True)
class Yardstick:
    """What residuals are measured by, the same for every hypothesis: one tensor entry a frame.

    `measured` [N, C, H, W] is the noise variance that the recording has, `floor` the same with what a codec makes of
    it in busy places, `tolerance` [N, 1, H, W] the variance of what
    a simulator may get wrong at an edge, `counted` [N, 1, H, W] the pixels that count, `temper` by how much a block's
    residuals depend on each other.
    """

    noise: NoiseModel
    measured: Tensor
    floor: Tensor
    tolerance: Tensor
    counted: Tensor
    temper: float
    allowance: float  # share of the variance that is for effects unlike their definitions
    scatter: CodecScatter | None = None  # what an encoder makes of noise
    scale: float = 1.0  # size of the pictures that are compared against the recording's, whose pixels' noise they share

    @property
    def variance(self) -> Tensor:
        """Of a residual [N, C, H, W] at the floor."""
        return self.measured + self.tolerance


@dataclass(frozen=True)
class FrameScore:
    """One frame under one hypothesis."""

    loglik: np.ndarray  # [blocks] nats
    excess: float
    error: float  # grey levels squared


def predicted_noise(yardstick: Yardstick, variance: Tensor | None, like: Tensor, segments: Sequence[int]) -> Tensor:
    """The variance [B, C, H, W] of noise that a hypothesis predicts; `variance` is that of its noise effects."""
    noise = yardstick.noise
    if variance is None and yardstick.scatter is None:
        return torch.full_like(like, max(float(noise.quiet((1,))[0]) * yardstick.scale**2, LEAST))
    before = torch.full_like(like, noise.base) if variance is None else variance + noise.base
    if yardstick.scatter is not None:
        return yardstick.scatter.at(before.sqrt(), segments).clamp(min=LEAST)
    levels = torch.linspace(0, 0.3, 301)  # a table of standard deviations: the encoder's share is one
    table = torch.from_numpy(noise.attenuation(levels.double().numpy() ** 2)).float()
    position = (before.sqrt() * 1000).clamp(max=299.99)
    low = position.long()
    found = table[low] + (position - low) * (table[low + 1] - table[low]) + noise.rounding
    return (found * yardstick.scale**2).clamp(min=LEAST)


def mismatch(yardstick: Yardstick, predicted: Tensor, segments: list[int]) -> Tensor:
    """Squared difference [B, C, H, W] of the standard deviations of noise, predicted and measured."""
    return (predicted.sqrt() - yardstick.measured[segments].sqrt()).square()


def score(
    yardstick: Yardstick,
    residual: Tensor,
    predicted: Tensor,
    segments: list[int],
    outliers: float = 0.0,
    flexible: bool = False,
    varied: Sequence[Varied] = (),
    unpredicted: Tensor | None = None,
    whole: Tensor | None = None,
) -> list[FrameScore]:
    """The frames `segments`, whose residuals [B, C, H, W] and predicted noise are given.

    A `flexible` prediction pays for what it makes up of a simulator's own tolerance. `varied` says how
    labels with grain are predicted to vary. Where `unpredicted` [H, W] is true, every value is as likely as another.
    The error is that of the residuals, or of the `whole` ones of which they are a part.
    """
    counted = yardstick.counted[segments].float()
    tolerance = yardstick.tolerance[segments]
    variance = predicted + tolerance + sum(each.variance for each in varied)
    density = _log_student(residual.square() / variance) - 0.5 * variance.log()
    floor = yardstick.measured[segments] + tolerance

    def squares(left: Tensor) -> Tensor:
        squared = matched(left.square(), floor, varied, yardstick.counted[segments])
        if outliers:
            far = (squared > 16 * floor) & (counted > 0)
            if float(far.sum()) <= 2 * FEW * float(counted.sum()) * residual.shape[1]:
                squared = torch.where(far, floor, squared)
        return squared if unpredicted is None else torch.where(unpredicted, floor, squared)

    if outliers:
        density = torch.logaddexp(density + np.log1p(-outliers), torch.full_like(density, np.log(outliers)))
    if flexible:
        density = density - _PRICE / 2
    differing = mismatch(yardstick, predicted, segments)
    if unpredicted is not None:
        density = density.masked_fill(unpredicted, 0.0)
        differing = differing.masked_fill(unpredicted, 0.0)
    squared = squares(residual)
    nats = (density * counted).sum(1, keepdim=True) / yardstick.temper
    height, width = (math.ceil(size / _CELLS) for size in nats.shape[-2:])
    blocks = F.avg_pool2d(nats, (height, width), ceil_mode=True, divisor_override=1)
    pixels = counted.sum((1, 2, 3)).clamp(min=1) * residual.shape[1]
    excess = (((squared + differing) / floor) * counted).sum((1, 2, 3)) / pixels
    # What averaging took away of the noise, and of its mismatch, is still there in the recording's own pixels.
    fine = differing / yardstick.scale**2 + yardstick.measured[segments] * (1 / yardstick.scale**2 - 1)
    error = (((squared if whole is None else squares(whole)) + fine) * counted).sum((1, 2, 3)) / pixels * 255**2
    return [
        FrameScore(blocks[k].flatten().double().numpy(), float(excess[k]), float(error[k]))
        for k in range(len(segments))
    ]


def temper(residual: Tensor, variance: Tensor, counted: Tensor) -> float:
    """By how much sums over blocks vary more than those of independent residuals [N, C, H, W] would; at least 2."""
    scaled = (residual / variance.sqrt()).clamp(-6, 6) * counted
    sums = _block_sums(scaled.sum(1, keepdim=True))
    counts = _block_sums(counted.float()) * residual.shape[1]
    whole = counts > 0.5 * BLOCK * BLOCK
    if not whole.any():
        return 2.0
    inflation = (sums[whole].square() / counts[whole]).mean() / (
        scaled.square().sum() / (counted.sum() * residual.shape[1])
    )
    return min(max(float(inflation), 2.0), 64.0)


def _log_student(squared: Tensor) -> Tensor:
    """Log-density of Student's distribution, scaled to segment variance, but for its constant."""
    return -(FREEDOM + 1) / 2 * torch.log1p(squared / (FREEDOM - 2))


def _block_sums(values: Tensor) -> Tensor:
    return F.avg_pool2d(values, BLOCK, ceil_mode=True, divisor_override=1)
