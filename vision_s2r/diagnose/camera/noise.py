"""From the light on the sensor to its values: what noise does to their mean and spread."""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.special import ndtri
from torch import Tensor

from vision_s2r.camera.colour import to_coded, to_linear
from vision_s2r.diagnose.case import Values

_LEVELS = 129  # of the light, equally spaced in coded values
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
    linear: bool  # coded values are light

    @classmethod
    def of(cls, values: Values, encoding: str, channels: int) -> "Tail":
        """The tail of a set of effects, neutral where they say nothing."""
        white = values.get("white_balance", {})
        gains = (white.get("red", 1.0), 1.0, white.get("blue", 1.0)) if channels == 3 else (1.0,)
        return cls(
            values.get("read_noise", {}).get("sigma", 0.0),
            values.get("shot_noise", {}).get("full_well", float("inf")),
            gains,
            values.get("gamma", {}).get("gamma", 1.0),
            encoding == "linear",
        )

    @property
    def noisy(self) -> bool:
        """Whether there is any noise."""
        return self.sigma > 0 or self.full_well < float("inf")

    def __call__(self, coded: Tensor) -> tuple[Tensor, Tensor | None]:
        """Mean, and variance where there is noise, of the values that coded light [B, C, H, W] gives."""
        if not self.noisy:
            return self._process(coded), None
        mean, variance = self.table()
        position = (coded.clamp(0, 1) * (_LEVELS - 1)).contiguous()
        index = position.long().clamp(max=_LEVELS - 2)
        part = position - index
        offset = (torch.arange(coded.shape[1]) * _LEVELS)[:, None, None]
        index += offset
        flat_mean, flat_variance = mean.flatten(), variance.flatten()

        def interpolated(table: Tensor) -> Tensor:
            low = table[index]
            return low + part * (table[index + 1] - low)

        return interpolated(flat_mean), interpolated(flat_variance)

    def table(self) -> tuple[Tensor, Tensor]:
        """Mean and variance [C, levels] of the values at equally spaced coded light."""
        coded = torch.linspace(0, 1, _LEVELS)
        light = coded if self.linear else to_linear(coded)
        spread = (self.sigma**2 + light / self.full_well).sqrt()
        drawn = (light[:, None] + spread[:, None] * _DRAWS).clamp(0, 1)  # [levels, draws]
        drawn = drawn if self.linear else to_coded(drawn)
        values = self._process(drawn.expand(1, len(self.gains), -1, -1))[0]
        return values.mean(-1), values.var(-1, correction=0)

    def _process(self, coded: Tensor) -> Tensor:
        if any(gain != 1 for gain in self.gains):
            coded = (coded * torch.tensor(self.gains)[:, None, None]).clamp(0, 1)
        return coded if self.gamma == 1 else coded.clamp(min=1e-12) ** self.gamma
