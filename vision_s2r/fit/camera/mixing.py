"""Frames that are mixed with those before them, by a filter against noise or charge that stays: what tells that.

Neither a grain nor a lamp knows what the last frame showed.
"""

from collections.abc import Iterator

from torch import Tensor

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


def mixtures(mean: Tensor, before: Tensor) -> Iterator[Tensor]:
    """By how much a mixture with the frames `before` is more than a mean, each [B, C, H, W].

    One of coded values, and some of light, which is about their square.
    """
    yield before - mean
    for share in _SHARES:
        yield (mean.square() * (1 - share) + before.square() * share).sqrt() - mean
