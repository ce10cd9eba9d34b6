"""The noise of a recording: how much of it there is at each brightness, and what the simulator cannot do better."""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
import torch.nn.functional as F
from scipy.optimize import least_squares, minimize_scalar
from torch import Tensor

from vision_s2r.camera.colour import Curve
from vision_s2r.fit.camera.codec import CodecScatter, within_blocks
from vision_s2r.fit.camera.flat_fields import flat_fields, is_white, noise_of
from vision_s2r.fit.camera.independent import independent_squares
from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.prediction import Pictures
from vision_s2r.fit.camera.smoothing import smoothed
from vision_s2r.fit.case import Values

BINS = 20  # of brightness, equally spaced in what is coded, or in the square root of what is light
IMPLAUSIBLE = (6 / 255) ** 2  # variance in flat places that is no noise behind an encoder: the light is wrong
LEAST = (0.1 / 255) ** 2  # variance: an encoder may leave none at all
QUIET, LOUD = 0.2, 0.75  # steps of the bits: the measurement noise of a camera without noise effects lies between these
_BETTER = 20.0  # half squared standard deviations, by which a noise beside shot and read noise must be the better story
_MISTOLD = 15.0  # half squared standard deviations of a brightness, by which what it is told as may be off
_FILTERED = 3.8  # samples behind the filter that say as much as an independent one
_CERTAIN = 2e4  # independent samples of a brightness: more are no better, since the mean is only nearly known
_IMMERKAER = torch.tensor([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]]) / 6


@dataclass(frozen=True)
class Attenuation:
    """What an encoder leaves of white noise: standard deviations before it [L] and after it; the same without one.

    After it [L], or of each channel and brightness of the pictures at hand [L, C, BINS].
    """

    before: np.ndarray
    after: np.ndarray

    def __call__(self, variance: np.ndarray) -> np.ndarray:
        """The variance after it; where it is known by brightness, of variances [C, BINS]."""
        spread = np.sqrt(variance)
        above = np.clip(np.searchsorted(self.before, spread), 1, len(self.before) - 1)
        part = (spread - self.before[above - 1]) / (self.before[above] - self.before[above - 1])
        low, high = (self._at(index) for index in (above - 1, above))
        return np.asarray((low + part * (high - low)) ** 2)

    def _at(self, index: np.ndarray) -> np.ndarray:
        if self.after.ndim == 1:
            return np.asarray(self.after[index])
        return np.asarray(np.take_along_axis(self.after, index[None], 0)[0])

    def before_it(self, variance: np.ndarray) -> np.ndarray:
        """The variance [C, BINS] before it, from those after it; NaN where that is."""
        spread = [
            [np.interp(each, self.after[:, c, k], self.before) for k, each in enumerate(row)]
            for c, row in enumerate(np.sqrt(variance))
        ]
        return np.array(spread) ** 2


IDENTITY = Attenuation(np.array([0.0, 1.0]), np.array([0.0, 1.0]))


@dataclass(frozen=True)
class NoiseBins:
    """Noise of each frame by channel and brightness: sums of squares and counts [N, C, BINS], mean values [C, BINS]."""

    squares: np.ndarray
    counts: np.ndarray
    values: np.ndarray
    encoding: Curve
    repeated: float  # samples that say as much as an independent one
    independent: bool  # whether it is that of flat fields, and each pixel's own
    after: np.ndarray | None = None  # [L, C, BINS]: standard deviations that an encoder makes of those before it
    scatter: CodecScatter | None = None  # … in each of its blocks

    def variance(self, segments: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Variance [C, BINS] (NaN where nothing was seen) and number of samples [C, BINS]."""
        squares, counts = self.squares[list(segments)].sum(0), self.counts[list(segments)].sum(0)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(counts >= 30, np.maximum(squares / counts, 1e-12), np.nan), counts

    def weights(self, counts: np.ndarray) -> np.ndarray:
        """One over the standard deviation of the logarithm of variances of so many samples."""
        return np.asarray(np.sqrt(np.minimum(counts / self.repeated, _CERTAIN) / 2))


def _place(pictures: Tensor, encoding: Curve) -> Tensor:
    """Where in the bins, from 0 to BINS, the values [B, C, H, W] of pictures lie."""
    values = pictures.clamp(0, 1)
    return (values.sqrt() if encoding == "linear" else values) * BINS


def detail(mean: Tensor) -> Tensor:
    """How much a picture [B, C, H, W] varies around each pixel [B, 1, H, W]: what a warp or a kernel can get wrong."""
    local = (mean - smoothed(mean)).abs().amax(1, keepdim=True)
    return F.max_pool2d(local, 3, 1, padding=1)


def measure(
    residual: Tensor,
    mean: Tensor,
    counted: Tensor,
    white: bool,
    encoding: Curve,
    scattered: Iterable[tuple[Tensor, Tensor]] = (),
    steady: bool = True,
) -> NoiseBins:
    """The noise in flat places: of residuals [N, C, H, W] about a prediction `mean`, where `counted`.

    `white`: only what differs between neighbours is looked at, so that a smooth error of the prediction is none.
    `scattered`: what an encoder makes of noise of several strengths, as `codec.scattered` says it. Where light is not
    `steady`, frames are not quite predicted in theirs.
    """
    count, channels = residual.shape[:2]
    fine = detail(mean)
    limit = max(float(fine[counted].quantile(0.3) if counted.sum() < 2**24 else fine.median()), 1.5 / 255)
    flat = counted & (fine <= limit)
    plain = white and flat_fields(fine, counted)
    if plain:
        noise = noise_of(residual, mean)
        mean = level = smoothed(mean + residual, 2)  # noise is that of the light there is, not of what should be
        squared = noise.square()
    else:
        level = smoothed(mean)
        fine_part = _filtered(residual, flat, white, steady)
        squared = independent_squares(fine_part, flat, level) if white else fine_part.square()
    index = _place(level, encoding).long().clamp(max=BINS - 1)
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
    centres = ((torch.arange(BINS) + 0.5) / BINS) ** (2 if encoding == "linear" else 1)
    values = torch.where(counts.sum(0) > 0, values / counts.sum(0).clamp(min=1), centres)
    repeated = _FILTERED if white and not plain else 1.0
    independent = plain and is_white(noise)
    found = squares.numpy(), counts.numpy(), values.numpy(), encoding, repeated, independent
    made = [
        (torch.bincount(at, of[chosen].double(), minlength=total).reshape(shape).sum(0), blocks)
        for of, blocks in scattered
    ]
    if not made:
        return NoiseBins(*found)
    after = _spreads(torch.stack([of for of, _ in made]), counts.sum(0))
    return NoiseBins(*found, after, CodecScatter.of([blocks for _, blocks in made]))


def _spreads(squares: Tensor, counts: Tensor) -> np.ndarray:
    """Standard deviations [L, C, BINS], rising with L, of squares and counts; where nothing was seen, those of all."""
    mean = torch.where(counts > 0, squares / counts.clamp(min=1), squares.sum((1, 2), keepdim=True) / counts.sum())
    return np.asarray(torch.cummax(mean.sqrt(), 0).values.numpy())


def _filtered(residual: Tensor, flat: Tensor, white: bool, steady: bool) -> Tensor:
    """Residuals [N, C, H, W] without what is no noise: what neighbours share where it is white, else wrong light."""
    if white:
        kernel = _IMMERKAER.expand(residual.shape[1], 1, 3, 3)
        return F.conv2d(F.pad(residual, (1,) * 4, mode="replicate"), kernel, groups=residual.shape[1])
    if not steady or float(residual[flat.expand_as(residual)].square().median()) > IMPLAUSIBLE:
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

    base: float  # variance of measurement noise that no effect is named for, without rounding
    rounding: float  # variance of what values are rounded to
    attenuation: Attenuation
    encoding: Curve
    black: float = 0.0  # of full scale, under the light that shot noise is of

    def quiet(self, shape: tuple[int, ...]) -> np.ndarray:
        """The variance that a camera without noise effects has, of this shape; of [C, BINS] where an encoder asks."""
        return np.maximum(self.attenuation(np.full(shape, self.base)) + self.rounding, self._least)

    @property
    def _least(self) -> float:
        """A variance that is as good as none: rounding leaves more, an encoder may leave nothing at all."""
        return min(LEAST, self.rounding or LEAST)

    def at(self, values: Values, levels: np.ndarray) -> np.ndarray:
        """The variance [C, K] predicted at mean coded values `levels` [C, K]."""
        tail = replace(Tail.of(values, self.encoding, len(levels)), black=self.black)
        if not tail.noisy:
            return self.quiet(levels.shape)
        return np.maximum(self.attenuation(tail.variance_about(levels) + self.base) + self.rounding, self._least)

    def fit(
        self, values: Values, names: Sequence[str], bins: NoiseBins, segments: Sequence[int]
    ) -> dict[str, dict[str, float]]:
        """The read and shot noise of `names` that the measured noise speaks for, beside the rest of `values`."""
        variance, counts = bins.variance(segments)
        usable = np.isfinite(variance) & (variance > 0)
        if not usable.any():
            return {name: {"read_noise": {"sigma": 0.0}, "shot_noise": {"full_well": 1e6}}[name] for name in names}
        weight, measured = bins.weights(counts[usable]), np.maximum(variance[usable], self._least)
        quiet = {name: value for name, value in values.items() if name not in _CHARTS}

        def effects(point: np.ndarray) -> dict[str, dict[str, float]]:
            return {name: _CHARTS[name].setting(x) for name, x in zip(names, point, strict=True)}

        def residual(point: np.ndarray) -> np.ndarray:
            return np.asarray(weight * np.log(measured / self.at(quiet | effects(point), bins.values)[usable]))

        bounds = np.array([_CHARTS[name].bounds for name in names]).T
        ends = [
            least_squares(residual, start, bounds=bounds, diff_step=0.01, loss="soft_l1", f_scale=3.0)
            for start in zip(*(_CHARTS[name].starts for name in names), strict=True)
        ]
        return effects(min(ends, key=lambda end: end.cost).x)


@dataclass(frozen=True)
class _Chart:
    """A noise effect's parameter as a fit has it: the logarithm of its standard deviation in full light."""

    setting: Callable[[float], dict[str, float]]
    bounds: tuple[float, float]
    starts: tuple[float, ...]


_CHARTS = {
    "read_noise": _Chart(
        lambda x: {"sigma": float(np.exp(x))}, (np.log(1e-6), np.log(0.5)), (np.log(3e-4), np.log(0.01), np.log(0.04))
    ),
    "shot_noise": _Chart(
        lambda x: {"full_well": float(np.exp(-2 * x))},
        (-0.5 * np.log(1e6), -0.5 * np.log(10.0)),
        (np.log(3e-3), np.log(0.03), np.log(0.12)),
    ),
}


def _enough(variance: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Where [C, BINS] (bool) enough samples tell a variance."""
    return np.asarray(np.isfinite(variance) & (counts > 500))


def base_noise(bins: NoiseBins, segments: Sequence[int], values: Values, step: float) -> float:
    """The variance of measurement noise that needs no effect: within what rounding to a step has beside it.

    Where some brightness has more, the camera has shot or read noise, and what else there is is fitted beside both to
    the photon transfer curve (EMVA 1288, section 6): none, unless that is much the worse story. In coded values shot
    noise is nearly as even as it is. Flat fields have none beside them.
    """
    variance, counts = bins.variance(segments)
    enough = _enough(variance, counts)
    least, most = ((level * step) ** 2 for level in (QUIET, LOUD))
    if not enough.any():
        return float(np.clip((0.5 / 255) ** 2, least, most))
    rounding = step**2 / 12
    if np.quantile(variance[enough], 0.8) - rounding <= most:
        return float(np.clip(np.quantile(variance[enough], 0.2) - rounding, least, most))
    if bins.independent:
        return 0.0
    names = sorted(_CHARTS)

    def cost(base: float) -> float:
        return _told(NoiseModel(base, rounding, IDENTITY, bins.encoding), values, names, bins, segments)[0]

    found = minimize_scalar(cost, bounds=(0.0, most), method="bounded", options={"xatol": 0.02 * most})
    return float(found.x) if found.fun < cost(0.0) - _BETTER else 0.0


def _told(
    noise: NoiseModel, values: Values, names: Sequence[str], bins: NoiseBins, segments: Sequence[int]
) -> tuple[float, dict[str, dict[str, float]]]:
    """Noise effects fitted to the measured noise, and how badly they tell it: half squared standard deviations."""
    variance, counts = bins.variance(segments)
    enough = _enough(variance, counts)
    fitted = noise.fit(values, names, bins, segments) if names else {}
    model = noise.at(dict(values) | fitted, bins.values)[enough]
    misfit = bins.weights(counts[enough]) * np.log(np.maximum(variance[enough], 1e-12) / model)
    return float((9 * (np.sqrt(1 + (misfit / 3) ** 2) - 1)).sum()), fitted


def photon_transfer(noise: NoiseModel, values: Values, names: Collection[str], bins: NoiseBins) -> dict[str, float]:
    """Of these noise effects those that flat fields' noise asks for beside the other, with nats (EMVA 1288, section 6).

    None where it is not each pixel's own, or varies with the light as read and shot noise together do not.
    """
    every, both = range(len(bins.squares)), sorted(names)
    if not bins.independent:
        return {}

    def misfit(chosen: list[str]) -> float:
        """With the tone of `values`, or none: an offset of black is told as a tone, which it is not."""
        return min(_told(noise, tone, chosen, bins, every)[0] for tone in (values, {}))

    whole = misfit(both)
    if whole > _MISTOLD * _enough(*bins.variance(every)).sum():
        return {}
    nats = {name: misfit([each for each in both if each != name]) - whole for name in both}
    return {name: gained for name, gained in nats.items() if gained > _BETTER}


def told_otherwise(
    noise: NoiseModel, values: Values, names: Sequence[str], bins: NoiseBins, segments: Sequence[int]
) -> list[dict[str, dict[str, float]]]:
    """Noise effects fitted beside measurement noise from none to most, and in the curves that coded values may have.

    Those are left out that tell a worse story.
    """
    most = LOUD**2 * (12 * noise.rounding or 1 / 255**2)
    curves: tuple[Curve, ...] = ("linear",) if noise.encoding == "linear" else ("srgb", "power")
    models = [
        replace(noise, base=base, encoding=curve) for base in (noise.base, 0.0, most / 2, most) for curve in curves
    ]
    told = [_told(model, values, names, bins, segments) for model in models]
    best = min(cost for cost, _ in told)
    return [fitted for cost, fitted in told if cost < best + _BETTER]


def spread_map(bins: NoiseBins, pictures: Tensor, noise: NoiseModel) -> Tensor:
    """The measured variance [N, C, H, W] at the brightness of each pixel of `pictures`, which are smooth enough.

    Behind an encoder it is what that makes there of the noise which is as strong as makes what was measured of it.
    """
    variance, _ = bins.variance(range(len(bins.squares)))
    if bins.scatter is not None:
        strong = noise.attenuation.before_it(variance)
        before = _at_brightness(strong, np.full(strong.shape, noise.base), bins, pictures)
        return bins.scatter.at(before.sqrt(), range(len(pictures))).clamp(min=LEAST)
    return _at_brightness(variance, noise.quiet(variance.shape), bins, pictures)


def _at_brightness(variance: np.ndarray, quiet: np.ndarray, bins: NoiseBins, pictures: Tensor) -> Tensor:
    """What a table [C, BINS] has at the brightness of pixels [N, C, H, W]: NaN where nothing was seen.

    It is not much less than `quiet` [C, BINS].
    """
    filled = quiet.copy()
    for c, row in enumerate(variance):
        known = np.isfinite(row)
        if known.any():
            filled[c] = np.interp(np.arange(BINS), np.flatnonzero(known), row[known])
    table = torch.from_numpy(np.maximum(filled, np.maximum(quiet * 0.3, LEAST))).float()
    position = _place(smoothed(pictures), bins.encoding) - 0.5
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
