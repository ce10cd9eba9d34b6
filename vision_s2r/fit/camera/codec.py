"""What JPEG makes of noise, which depends on what it is noise on."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.prediction import Pictures, encoded, without_encoder
from vision_s2r.fit.case import Values

BEFORE = torch.tensor([0.0, 0.25, 0.5, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64]) / 255  # standard deviations
DRAWS = 8  # of noise, that a mean behind the codec is of
_BLOCK = 8  # px, of the codec
_SLIGHT = slice(1, 4)  # of those before it: as little as a camera has that no effect is named for
_FEW = 4  # draws of a standard deviation
_SHARED = 0.3  # of a block's variance, that is the frame's
_NEAREST = 0.5 / 255  # to black or white, that noise about it has a shape


def attenuation(quality: float, channels: int) -> Tensor:
    """What JPEG leaves of white noise of these standard deviations [levels], on a soft gradient about mid grey."""
    generator = torch.Generator().manual_seed(0)
    ramp = torch.linspace(0.35, 0.65, 64)
    clean = ((ramp[:, None] + ramp) / 2).expand(1, channels, 64, 64)
    noise = torch.randn((len(BEFORE), channels, 64, 64), generator=generator) * BEFORE[:, None, None, None]
    after = (encoded((clean + noise).clamp(0, 1), quality) - encoded(clean, quality)).square().mean((1, 2, 3)).sqrt()
    return torch.cummax(after, 0).values


def scattered(pictures: Pictures, reference: Values, quality: float, mean: Tensor) -> Iterator[tuple[Tensor, Tensor]]:
    """Of each standard deviation before JPEG what it makes of such noise on a prediction.

    Squares [N, C, H, W] about `mean`, which is predicted behind it, and the variance of each block [N, C, h, w]. A
    coefficient near the middle between two levels falls on either side; busy blocks have more of these.
    """
    clean = pictures.predict(without_encoder(reference), range(len(pictures.sim))).mean
    for level in BEFORE:
        total, squares = torch.zeros_like(mean), torch.zeros_like(mean)
        for draw in _draws(clean, _FEW):
            away = encoded(_noisy(clean, level, draw), quality) - mean
            total += away
            squares += away.square_()
        yield squares / _FEW, _block_means((squares - total.square_() / _FEW).clamp(min=0)) / (_FEW - 1)


def behind(pictures: Pictures, mean: Tensor, values: Values, base: float) -> Tensor:
    """What the encoder among `values` makes of pictures of this mean [B, C, H, W], which are never without noise.

    `base`: the variance that no effect is named for. What it makes of the mean itself has steps where this has none.
    """
    if not pictures.encodes(values):
        return mean
    tail, variance = Tail.of(values, pictures.encoding, mean.shape[1]), torch.full_like(mean, base)
    if tail.noisy:
        variance += torch.from_numpy(tail.variance_about(mean.transpose(0, 1).numpy())).transpose(0, 1)
    spread, total = variance.sqrt(), torch.zeros_like(mean)
    for draw in _draws(mean, DRAWS):
        total += pictures.through_encoder(_noisy(mean, spread, draw), values)
    return total / DRAWS


def _noisy(mean: Tensor, spread: Tensor, draw: Tensor) -> Tensor:
    """Values of this mean [B, C, H, W] and standard deviation that go beyond neither black nor white, by a draw."""
    dark = mean < 0.5
    away = torch.where(dark, mean, 1 - mean).clamp(min=_NEAREST)
    width = torch.log1p((spread / away).square()).sqrt()
    found = away * torch.exp(width * draw - width.square() / 2)
    return torch.where(dark, found, 1 - found).clamp(0, 1)


def _draws(like: Tensor, count: int) -> Tensor:
    """Of a standard normal distribution [count, C, H, W], every frame the same; other ones for another count."""
    return _drawn(count, tuple(like.shape[1:]))


@lru_cache(maxsize=4)
def _drawn(count: int, shape: tuple[int, ...]) -> Tensor:
    return torch.randn((count, *shape), generator=torch.Generator().manual_seed(count))


@dataclass(frozen=True)
class CodecScatter:
    """The standard deviation [levels, N, C, h, w] that JPEG makes, in each of its blocks, of those before it."""

    after: Tensor

    @classmethod
    def of(cls, variances: Sequence[Tensor]) -> "CodecScatter":
        """From those of blocks [N, C, h, w], for noise of each standard deviation before JPEG.

        A few draws may move no coefficient of a block where others would: some of it is as much as in all blocks.
        """
        own = torch.stack(list(variances))
        shared = own.mean((-2, -1), keepdim=True)
        return cls(torch.cummax(((1 - _SHARED) * own + _SHARED * shared).sqrt(), 0).values)

    def at(self, before: Tensor, segments: Sequence[int]) -> Tensor:
        """The variance behind JPEG of noise of these standard deviations [B, C, H, W] on these frames."""
        spread = _block_means(before).clamp(max=float(BEFORE[-1]))
        above = torch.bucketize(spread.contiguous(), BEFORE).clamp(1, len(BEFORE) - 1)
        part = (spread - BEFORE[above - 1]) / (BEFORE[above] - BEFORE[above - 1])
        after = self.after[:, list(segments)]
        low, high = (after.gather(0, index[None])[0] for index in (above - 1, above))
        return _enlarged((low + part * (high - low)).square(), before)

    def slight(self, residual: Tensor, counted: Tensor) -> Tensor:
        """The variance [N, C, H, W] of what little noise makes: as much as the quieter half of residuals has, at most.

        As little as it may be it is never told from what a simulator gets wrong.
        """
        inside = _block_means(counted.float()) == 1
        seen = _block_means(residual.square().mean(1, keepdim=True))[inside].median()
        best, found = math.inf, self.after[0]
        for after in self.after[_SLIGHT]:
            median = after.square().mean(1, keepdim=True)[inside].median()
            distance = abs(math.log(float(median) / max(float(seen), 1e-12) + 1e-9))
            if distance < best:
                best, found = distance, after
        return _enlarged(found.square(), residual)


def within_blocks(values: Tensor) -> Tensor:
    """Values [N, C, H, W] less the mean of their block, where a codec puts what is smooth."""
    return values - _enlarged(_block_means(values), values)


def _block_means(values: Tensor) -> Tensor:
    """Of values [N, C, H, W], [N, C, H / 8, W / 8] rounded up; a block at the rim is of the pixels that there are."""
    return F.avg_pool2d(values, _BLOCK, ceil_mode=True)


def _enlarged(blocks: Tensor, like: Tensor) -> Tensor:
    """What each block has, at each of its pixels: as high and wide as `like`."""
    height, width = like.shape[-2:]
    return blocks.repeat_interleave(_BLOCK, -2).repeat_interleave(_BLOCK, -1)[..., :height, :width]
