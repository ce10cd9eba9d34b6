"""The noise of a recording: how much of it there is at each brightness, and what the simulator cannot do better."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from scipy.optimize import least_squares
from torch import Tensor

from vision_s2r.camera.effect import Encoding
from vision_s2r.fit.camera.codec import within_blocks
from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.prediction import Pictures
from vision_s2r.fit.case import Values

BINS = 20  # of brightness
IMPLAUSIBLE = (6 / 255) ** 2  # variance in flat places that is no noise behind an encoder: the light is wrong
LEAST = (0.1 / 255) ** 2  # variance: an encoder may leave none at all
QUIET, LOUD = 0.2 / 255, 0.75 / 255  # the measurement noise of a camera without noise effects lies between these
_IMMERKAER = torch.tensor([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]]) / 6


@dataclass(frozen=True)
class Attenuation:
    """What an encoder leaves of white noise: standard deviations before and after it; the same without one."""

    before: np.ndarray
    after: np.ndarray

    def __call__(self, variance: np.ndarray) -> np.ndarray:
        spread = np.sqrt(variance)
        inside = np.interp(spread, self.before, self.after)
        return (inside + np.maximum(spread - self.before[-1], 0) * (self.after[-1] / self.before[-1])) ** 2


IDENTITY = Attenuation(np.array([0.0, 1.0]), np.array([0.0, 1.0]))


@dataclass(frozen=True)
class NoiseBins:
    """Noise of each frame by channel and brightness: sums of squares and counts [N, C, BINS], mean values [C, BINS]."""

    squares: np.ndarray
    counts: np.ndarray
    values: np.ndarray

    def variance(self, segments: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Variance [C, BINS] (NaN where nothing was seen) and number of samples [C, BINS]."""
        squares, counts = self.squares[list(segments)].sum(0), self.counts[list(segments)].sum(0)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(counts >= 30, np.maximum(squares / counts, LEAST), np.nan), counts


def smoothed(pictures: Tensor) -> Tensor:
    """The mean [B, C, H, W] of each pixel and its eight neighbours."""
    return F.avg_pool2d(F.pad(pictures, (1,) * 4, mode="replicate"), 3, 1)


def detail(mean: Tensor) -> Tensor:
    """How much a picture [B, C, H, W] varies around each pixel [B, 1, H, W]: what a warp or a kernel can get wrong."""
    local = (mean - smoothed(mean)).abs().amax(1, keepdim=True)
    return F.max_pool2d(local, 3, 1, padding=1)


def measure(residual: Tensor, mean: Tensor, counted: Tensor, white: bool, known: Tensor) -> NoiseBins:
    """The noise in flat places: of residuals [N, C, H, W] about a prediction `mean`, where `counted`.

    `white`: only what differs between neighbours is looked at, so that a smooth error of the prediction is none.
    `known` [N, 1, H, W]: variance that is no noise of the camera's, and not counted.
    """
    count, channels = residual.shape[:2]
    fine = detail(mean)
    limit = max(float(fine[counted].quantile(0.3) if counted.sum() < 2**24 else fine.median()), 1.5 / 255)
    flat = counted & (fine <= limit)
    squared = _filtered(residual, flat, white).square() - known
    index = (smoothed(mean).clamp(0, 1) * BINS).long().clamp(max=BINS - 1)
    shape = (count, channels, BINS)
    if white:
        squared = torch.minimum(squared, _ceiling(squared, index, flat))
    slot = (
        index
        + torch.arange(channels)[:, None, None] * BINS
        + torch.arange(count)[:, None, None, None] * channels * BINS
    )
    chosen = flat.expand_as(slot)
    at = slot[chosen]
    total = count * channels * BINS
    counts = torch.bincount(at, minlength=total).reshape(shape).double()
    squares = torch.bincount(at, squared[chosen].double(), minlength=total).reshape(shape)
    values = torch.bincount(at, mean[chosen].double(), minlength=total).reshape(shape).sum(0)
    centres = (torch.arange(BINS) + 0.5) / BINS
    values = torch.where(counts.sum(0) > 0, values / counts.sum(0).clamp(min=1), centres)
    return NoiseBins(squares.numpy(), counts.numpy(), values.numpy())


def _filtered(residual: Tensor, flat: Tensor, white: bool) -> Tensor:
    """Residuals [N, C, H, W] without what is no noise: what neighbours share where it is white, else wrong light."""
    if white:
        kernel = _IMMERKAER.expand(residual.shape[1], 1, 3, 3)
        return F.conv2d(F.pad(residual, (1,) * 4, mode="replicate"), kernel, groups=residual.shape[1])
    if float(residual[flat.expand_as(residual)].square().median()) > IMPLAUSIBLE:
        return within_blocks(residual)
    return residual


def _ceiling(squared: Tensor, index: Tensor, flat: Tensor) -> Tensor:
    """Six standard deviations, squared, of the bin of each pixel: single pixels that are off are no noise."""
    limits = torch.full((BINS,), float("inf"))
    chosen = flat.expand_as(index)
    at, values = index[chosen], squared[chosen]
    for k in range(BINS):
        inside = values[at == k]
        if len(inside) > 20:
            spread = max(float(inside.median()) / 0.455, (0.4 / 255) ** 2)
            limits[k] = 36 * spread
    return limits[index]


@dataclass(frozen=True)
class NoiseModel:
    """The noise that a recording has without noise effects, and what an encoder makes of noise."""

    base: float  # variance of measurement noise, without rounding
    rounding: float  # variance of rounding to the recording's bits
    attenuation: Attenuation
    encoding: Encoding

    @property
    def quiet(self) -> float:
        """The variance that a camera without noise effects has."""
        return max(float(self.attenuation(np.array([self.base]))[0]) + self.rounding, LEAST)

    def at(self, values: Values, levels: np.ndarray) -> np.ndarray:
        """The variance [C, K] predicted at mean coded values `levels` [C, K]."""
        tail = Tail.of(values, self.encoding, len(levels))
        if not tail.noisy:
            return np.full(levels.shape, self.quiet)
        mean, variance = (table.numpy() for table in tail.table())
        interpolated = np.stack(
            [np.interp(level, *_ordered(m, v)) for level, m, v in zip(levels, mean, variance, strict=True)]
        )
        return np.maximum(self.attenuation(interpolated + self.base) + self.rounding, LEAST)

    def fit(
        self, values: Values, names: Sequence[str], bins: NoiseBins, segments: Sequence[int]
    ) -> dict[str, dict[str, float]]:
        """The read and shot noise of `names` that the measured noise speaks for, beside the rest of `values`."""
        variance, counts = bins.variance(segments)
        usable = np.isfinite(variance) & (variance > 0)
        if not usable.any():
            return {name: {"read_noise": {"sigma": 0.0}, "shot_noise": {"full_well": 1e6}}[name] for name in names}
        weight = np.sqrt(np.minimum(counts[usable], 1e4) / 2)

        def effects(point: np.ndarray) -> dict[str, dict[str, float]]:
            found = {}
            for name, x in zip(names, point, strict=True):
                if name == "read_noise":
                    found[name] = {"sigma": float(np.exp(x))}
                else:
                    found[name] = {"full_well": float(np.exp(-2 * x))}
            return found

        def residual(point: np.ndarray) -> np.ndarray:
            model = self.at(dict(values) | effects(point), bins.values)[usable]
            measured = variance[usable]
            return weight * np.log(measured / model)

        low = np.array([np.log(1e-4) if name == "read_noise" else -0.5 * np.log(1e6) for name in names])
        high = np.array([np.log(0.5) if name == "read_noise" else -0.5 * np.log(10.0) for name in names])
        best = None
        for start in ([np.log(0.01), np.log(0.03)], [np.log(0.04), np.log(0.12)]):
            point = np.array([start[0] if name == "read_noise" else start[1] for name in names])
            found = least_squares(residual, point, bounds=(low, high), diff_step=0.01, loss="soft_l1", f_scale=3.0)
            if best is None or found.cost < best.cost:
                best = found
        assert best is not None
        return effects(best.x)


def _ordered(mean: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both by increasing mean: a saturated channel's mean stands still."""
    order = np.argsort(mean, kind="stable")
    return mean[order], variance[order]


def base_noise(bins: NoiseBins, segments: Sequence[int], rounding: float) -> float:
    """The variance of measurement noise: that of the quietest brightness, between what cameras have."""
    variance, counts = bins.variance(segments)
    enough = np.isfinite(variance) & (counts > 500)
    if not enough.any():
        return (0.5 / 255) ** 2
    quietest = np.quantile(variance[enough], 0.2) - rounding
    return float(np.clip(quietest, QUIET**2, LOUD**2))


def spread_map(bins: NoiseBins, pictures: Tensor, quiet: float) -> Tensor:
    """The measured variance [N, C, H, W] at the brightness of each pixel of `pictures`, which are smooth enough."""
    variance, _ = bins.variance(range(len(bins.squares)))
    filled = np.full(variance.shape, quiet)
    for c, row in enumerate(variance):
        known = np.isfinite(row)
        if known.any():
            filled[c] = np.interp(np.arange(BINS), np.flatnonzero(known), row[known])
    table = torch.from_numpy(np.maximum(filled, quiet * 0.3)).float()
    position = smoothed(pictures).clamp(0, 1) * BINS - 0.5
    low = position.floor().long().clamp(0, BINS - 2)
    part = (position - low).clamp(0, 1)
    offset = (torch.arange(pictures.shape[1]) * BINS)[:, None, None]
    flat = table.flatten()
    return flat[low + offset] * (1 - part) + flat[low + 1 + offset] * part


def counted_pixels(pictures: Pictures, values: Values, margin: int) -> Tensor:
    """Pixels [N, 1, H, W] that every hypothesis is held to: seen under the best of them, `margin` px inside."""
    seen = pictures.seen(values, range(len(pictures.sim)))
    outside = F.max_pool2d((~seen).float(), 2 * margin + 1, 1, padding=margin) > 0
    inner = ~outside
    for edge in (inner[..., :margin, :], inner[..., -margin:, :], inner[..., :margin], inner[..., -margin:]):
        edge.zero_()
    return inner
