"""From the light on the sensor to its values: what noise does to their mean and spread."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
import torch.nn.functional as F
from scipy.special import ndtri
from torch import Tensor

from vision_s2r.camera.colour import OF_CURVE, Curve
from vision_s2r.fit.case import Values

_LEVELS = 129  # of the light, equally spaced in coded values, or in the roots of linear ones
_DRAWS = torch.from_numpy(ndtri((np.arange(61) + 0.5) / 61)).float()
_DRAWS /= _DRAWS.std(correction=0)


@dataclass(frozen=True)
class Tail:
    """Noise, white balance and gamma together: a function of each pixel's light alone.

    Noise is Gaussian of the variance that read and shot noise have together; what it leaves below black or above
    white is clipped, which moves the mean as much as the curve's bend does.
    """

    sigma: float  # read noise, of full scale
    full_well: float  # electrons, or infinite
    gains: tuple[float, ...]  # a channel
    gamma: float
    curve: Curve
    black: float = 0.0  # of full scale, that a converter adds under all light

    @classmethod
    def of(cls, values: Values, curve: Curve, channels: int) -> "Tail":
        """The tail of a set of effects, neutral where they say nothing."""
        white = values.get("white_balance", {})
        gains = (white.get("red", 1.0), 1.0, white.get("blue", 1.0)) if channels == 3 else (1.0,)
        return cls(
            values.get("read_noise", {}).get("sigma", 0.0),
            values.get("shot_noise", {}).get("full_well", float("inf")),
            gains,
            values.get("gamma", {}).get("gamma", 1.0),
            curve,
        )

    @property
    def noisy(self) -> bool:
        """Whether there is any noise."""
        return self.sigma > 0 or self.full_well < float("inf")

    def mean(self, coded: Tensor) -> Tensor:
        """Of the values [B, C, H, W] that coded light of this shape gives."""
        return _interpolated(self.table()[0], coded, self.curve) if self.noisy else self.process(coded)

    def variance(self, coded: Tensor) -> Tensor | None:
        """Of the same values; None where there is no noise."""
        return _interpolated(self.table()[1], coded, self.curve) if self.noisy else None

    def variance_about(self, mean: np.ndarray) -> np.ndarray:
        """Of values of this mean [C, …]."""
        tables = zip(*(table.numpy() for table in self.table()), strict=True)
        return np.stack([np.interp(each, *_ordered(*of)) for each, of in zip(mean, tables, strict=True)])

    def table(self) -> tuple[Tensor, Tensor]:
        """Mean and variance [C, levels] of the values at equally spaced coded light, or roots of linear light."""
        return _table(self)

    def process(self, coded: Tensor) -> Tensor:
        """What white balance and gamma make of coded values [B, C, H, W]."""
        if any(gain != 1 for gain in self.gains):
            coded = (coded * torch.tensor(self.gains)[:, None, None]).clamp(0, 1)
        return coded if self.gamma == 1 else coded.clamp(min=1e-12) ** self.gamma


@lru_cache(maxsize=32)  # a fit mostly moves what comes before the tail
def _table(tail: Tail) -> tuple[Tensor, Tensor]:
    coded = torch.linspace(0, 1, _LEVELS) ** (2 if tail.curve == "linear" else 1)
    light = coded if tail.curve == "linear" else OF_CURVE[tail.curve][0](coded)
    spread = (tail.sigma**2 + light / tail.full_well).sqrt()
    drawn = (light[:, None] + tail.black + spread[:, None] * _DRAWS).clamp(0, 1)  # [levels, draws]
    if tail.curve != "linear":
        drawn = OF_CURVE[tail.curve][1](drawn)
    values = tail.process(drawn.expand(1, len(tail.gains), -1, -1))[0]
    return values.mean(-1), values.var(-1, correction=0)


def _ordered(mean: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both by increasing mean: a saturated channel's mean stands still."""
    order = np.argsort(mean, kind="stable")
    return mean[order], variance[order]


def _interpolated(table: Tensor, coded: Tensor, curve: Curve) -> Tensor:
    """What a table [C, levels] has at coded light [B, C, H, W]."""
    even = coded.clamp(0, 1)
    position = (even.sqrt() if curve == "linear" else even) * (_LEVELS - 1)
    index = position.long().clamp_(max=_LEVELS - 2)
    part = position - index
    at = (index + (torch.arange(len(table)) * _LEVELS)[:, None, None]).flatten()
    rise = F.pad(table.diff(dim=1), (0, 1)).flatten()
    low, slope = (each.index_select(0, at).view_as(part) for each in (table.flatten(), rise))
    return low + part * slope
