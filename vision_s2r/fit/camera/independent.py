"""Noise is drawn anew in each frame and at each pixel: what frames or places share is none.

Noise is told by its variance, and a sensor whose pixels differ from each other, or rows that are out of place, leave as
much of that as a sensor that is noisy. But an offset and a gain of a pixel's own are the same in all frames: they are
taken out by a regression over them, as EMVA 1288 (release 4, 6.6 and 8) tells temporal from spatial noise. And what is
wrong at an edge goes on along it.
"""

import torch
from torch import Tensor

_LEAST = 5  # frames in which a pixel must be seen for its own offset and gain to be told
_LEVERAGE = 0.6  # of one frame on what a pixel's regression says of it, from which it says nothing
_REPEATED = 0.1  # share of what looks like noise, that must repeat before anything is taken out
_APART = (3, 4)  # px, beyond the reach of the filter that takes out what neighbours share
_ALIKE = 0.15  # correlation of pixels so far apart, from which they share something: a kernel between pixels makes less
_MOST = 0.95  # share that is taken out
_FAR = 4.0  # standard deviations, beyond which single pixels do not tell a correlation


def independent_squares(values: Tensor, seen: Tensor, level: Tensor) -> Tensor:
    """Squares [N, C, H, W] whose expectation is the variance of what frames and places do not share.

    `values` [N, C, H, W] are residuals without what neighbours share, `seen` [N, 1, H, W] where they tell of noise,
    `level` [N, C, H, W] the brightness there. Squares are as they are where next to nothing is shared.
    """
    return _without_repeated(values, seen, level) * (1 - _of_neighbours(values, seen))


def _without_repeated(values: Tensor, seen: Tensor, level: Tensor) -> Tensor:
    weight = seen.to(values.dtype)
    count = weight.sum(0)
    if not bool((count >= _LEAST).any()):
        return values.square()
    about = (level * weight).sum(0) / count.clamp(min=1)
    away = (level - about) * weight
    spread = away.square().sum(0).clamp(min=1e-6)
    offset = (values * weight).sum(0) / count.clamp(min=1)
    gain = (values * away).sum(0) / spread
    leverage = 1 / count.clamp(min=1) + away.square() / spread
    usable = (count >= _LEAST) & seen & (leverage < _LEVERAGE)
    left = (values - offset - gain * away).square() / (1 - leverage.clamp(max=_LEVERAGE))
    whole = float(values.square()[usable].sum())
    share = float(left[usable].sum()) / whole if whole > 0 else 1.0
    if share > 1 - _REPEATED:
        return values.square()
    return torch.where(usable, left, values.square() * share)


def _of_neighbours(values: Tensor, seen: Tensor) -> float:
    """The share of the variance that pixels farther apart than the filter reaches have in common; 0 where it is little.

    White noise has none. What is wrong at edges goes on along them, and is of few pixels.
    """
    height, width = values.shape[-2:]
    if min(height, width) <= 2 * max(_APART) or not bool(seen.any()):
        return 0.0
    seen = seen.expand_as(values)
    typical = float(values[seen].abs().median()) / 0.6745
    near = values.clamp(-_FAR * typical, _FAR * typical)
    shared = [likeness(near, seen, dy, dx) for k in _APART for dy, dx in ((0, k), (k, 0))]
    most = max(abs(each) for each in shared)
    if most < _ALIKE:
        return 0.0
    even = typical**2 / max(float(values[seen].square().mean()), 1e-12)  # 1 of noise that all pixels have alike
    return min(max(2 * most, 1 - even), _MOST)


def likeness(values: Tensor, seen: Tensor, dy: int, dx: int) -> float:
    """The correlation of pixels so far apart."""
    height, width = values.shape[-2:]
    one, other = values[..., : height - dy, : width - dx], values[..., dy:, dx:]
    both = seen[..., : height - dy, : width - dx] & seen[..., dy:, dx:]
    a, b = one[both], other[both]
    power = float(a.square().mean() * b.square().mean()) ** 0.5 if len(a) else 0.0
    return float((a * b).mean()) / power if power > 0 else 0.0
