"""Light that differs from frame to frame: a nuisance, fitted to each frame alone and alike under every hypothesis.

A photograph has the exposure and the light of its moment. Where these differ between frames, no constant effect is the
cause, and whatever is fitted without them bends to make up for them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from numba import njit
from torch import Tensor

from vision_s2r.camera.colour import PEDESTAL, Curve, to_linear
from vision_s2r.fit.camera.effect import of_stage
from vision_s2r.fit.camera.mixing import MIXED, of_frame_before
from vision_s2r.fit.camera.smoothing import polynomials
from vision_s2r.fit.camera.student import FREEDOM

UNSTEADY = "light that differs from frame to frame"

Kind = Literal["steady", "exposure", "field"]

_PASSES = 3  # of reweighting: a hand before the board is no light
_RIDGE = 1e-5  # of the mean curvature: a frame that shows one grey has no veil of its own
_BLOCK = 1024  # values of a frame that are added up at a time, so that they stay in the cache
_POINTS = 20_000  # of a frame, that its light is fitted to, at most
_DIFFERS = 0.03  # standard deviation of the frames' gains, from which light may be said to differ
_LEFT = 0.8  # of what a simpler light leaves: one that is more the frames' own has to leave less than this
_TRIFLE = 0.05  # of what exposures take away: fields that take no more make up for clipping and the dark's own curve
_BLACK = 0.05  # of full scale: values below it say nothing of light, noise and a sensor's offset move them
LEAST_FRAMES = 3  # that have a spread
_FINEST = 80  # px of the shorter side, of the pictures on which it is decided


@dataclass(frozen=True)
class Lit:
    """Predictions [B, C, H, W] in the light of each frame: times a field of waves, and a veil over it."""

    mean: Tensor
    unlit: Tensor  # [B, C, H, W], above the curve's pedestal
    waves: Tensor  # [W, H, W]
    gain: Tensor  # [B, C, H, W]: what it multiplies the prediction by; nothing where the sensor is full
    weight: Tensor  # [B, C, H, W]
    coefficients: Tensor  # [B, K], of the waves and the veil

    def beside(self, slopes: Tensor) -> Tensor:
        """Changes of the unlit prediction [P, B, C, H, W] as lit, less what light would make up for."""
        lit = slopes * self.gain
        for frame in range(len(self.mean)):
            lit[:, frame] -= self.added(frame, torch.from_numpy(_solved(*self.equations(frame, lit[:, frame]))))
        return lit

    def equations(self, frame: int, targets: Tensor) -> tuple[np.ndarray, np.ndarray]:
        """Normal equations of the coefficients for targets [P, C, H, W] of one frame: [K, K] and [P, K]."""
        unlit, weight = (each[frame].flatten(1).numpy() for each in (self.unlit, self.weight))
        waves = self.waves.flatten(1).numpy()
        return _equations(unlit, weight, waves, self.veil, targets.flatten(2).contiguous().numpy())

    def added(self, frame: int, coefficients: Tensor) -> Tensor:
        """What light of these coefficients [P, K] adds to one frame: [P, C, H, W]."""
        field = torch.tensordot(coefficients[:, : len(self.waves)], self.waves, 1)[:, None]
        veil = coefficients[:, -1, None, None, None] if self.veil else 0.0
        return field * self.unlit[frame] + veil

    @property
    def veil(self) -> bool:
        return self.coefficients.shape[1] > len(self.waves)


@dataclass(frozen=True)
class FrameLight:
    """What frames have of their own: an exposure, or a smooth field of gain and a veil over it."""

    kind: Kind

    @property
    def hides(self) -> frozenset[str]:
        """Effects of which every frame may have a part of its own."""
        if self.kind == "steady":
            return frozenset()
        return frozenset({"exposure"} | (of_stage("light") if self.kind == "field" else set()))

    def on(self, mean: Tensor, real: Tensor, weight: Tensor, curve: Curve) -> Lit:
        """The likeliest light of each frame: `mean` and `real` [B, C, H, W], `weight` [B, 1 or C, H, W], 0 unseen.

        Both are values of this curve. Least squares under Student's weights; a frame's light is its own, whatever
        frames are asked for together.
        """
        height, width = mean.shape[-2:]
        waves, veil = polynomials(height, width)[: 6 if self.kind == "field" else 1], self.kind == "field"
        mean, pedestal = mean.contiguous(), np.float32(0 if veil else PEDESTAL[curve])
        whole = [each.expand_as(mean).flatten(2).contiguous().numpy() for each in (mean, real, weight)]
        stride = max(mean[0].numel() // _POINTS, 1) | 1  # odd, so that all columns are met
        of_few = waves.flatten(1).repeat(1, mean.shape[1])[:, ::stride].contiguous().numpy()
        lights, coefficients = [], []
        for frame in zip(*whole, strict=True):
            few = [each.reshape(1, -1)[:, ::stride].copy() for each in frame]
            coefficients.append(_likeliest(few, of_few, veil, pedestal))
            lights.append(_forgiving(coefficients[-1], waves.flatten(1).numpy(), pedestal, *frame))
        lit, robust, gain = (torch.from_numpy(np.stack(each)).view_as(mean) for each in zip(*lights, strict=True))
        return Lit(lit, mean + float(pedestal), waves, gain, robust, torch.from_numpy(np.stack(coefficients)))


STEADY = FrameLight("steady")


def _likeliest(points: Sequence[np.ndarray], waves: np.ndarray, veil: bool, pedestal: np.float32) -> np.ndarray:
    """Coefficients [K] at points of a frame: its prediction, what is real, the weight, each [1, D]; `waves` [W, D]."""
    mean, real, weight = points
    unlit = mean + pedestal
    coefficients = _solved(*_equations(unlit, weight, waves, veil, (real - mean)[None]))[0]
    for _ in range(_PASSES - 1):
        _, robust, _ = _forgiving(coefficients, waves, pedestal, mean, real, weight)
        coefficients = _solved(*_equations(unlit, robust, waves, veil, (real - mean)[None]))[0]
    return coefficients


def _solved(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Coefficients [P, K] from normal equations [K, K], [P, K]."""
    ridge = _RIDGE * matrix.diagonal().mean() + 1e-12
    return np.linalg.solve(matrix + ridge * np.eye(len(matrix)), vectors.T).T.astype(np.float32)


@njit(nogil=True, cache=True, fastmath=True)
def _equations(unlit, weight, waves, veil, targets):  # type: ignore[no-untyped-def]
    """Of what is unlit [C, D] times each wave [W, D], and a veil, for targets [P, C, D]; sums of a block at a time."""
    count, size = len(waves) + veil, unlit.shape[1]
    matrix, vectors = np.zeros((count, count)), np.zeros((len(targets), count))
    basis, weighed = np.ones((count, _BLOCK), np.float32), np.empty(_BLOCK, np.float32)
    for c in range(len(unlit)):
        for start in range(0, size, _BLOCK):
            part = slice(start, min(start + _BLOCK, size))
            light, counted = unlit[c, part], weight[c, part]
            for k in range(len(waves)):
                _times(light, waves[k, part], basis[k])
            for k in range(count):
                _times(counted, basis[k], weighed)
                for other in range(k + 1):
                    matrix[k, other] += _dot(weighed[: len(light)], basis[other])
                for p in range(len(targets)):
                    vectors[p, k] += _dot(weighed[: len(light)], targets[p, c, part])
    for k in range(count):
        for other in range(k):
            matrix[other, k] = matrix[k, other]
    return matrix, vectors


@njit(nogil=True, cache=True, fastmath=True)
def _times(one, other, product):  # type: ignore[no-untyped-def]
    for d in range(len(one)):
        product[d] = one[d] * other[d]


@njit(nogil=True, cache=True, fastmath=True)
def _dot(one, other):  # type: ignore[no-untyped-def]
    total = np.float32(0)
    for d in range(len(one)):
        total += one[d] * other[d]
    return total


@njit(nogil=True, cache=True)
def _forgiving(coefficients, waves, pedestal, mean, real, weight):  # type: ignore[no-untyped-def]
    """The prediction [C, D] in this light, weights that forgive single values what it leaves, and the light's gain."""
    zero, one, freedom = np.float32(0), np.float32(1), np.float32(FREEDOM)  # else the arithmetic would be double
    veil = coefficients[-1] if len(coefficients) > len(waves) else zero
    lit, robust, gain = np.empty_like(mean), np.empty_like(mean), np.empty_like(mean)
    field = np.full(mean.shape[1], one)
    for k in range(len(waves)):
        for d in range(len(field)):
            field[d] += coefficients[k] * waves[k, d]
    for c in range(len(mean)):
        for d in range(len(field)):
            found = (mean[c, d] + pedestal) * field[d] - pedestal + veil
            left = real[c, d] - found
            full = found >= one and real[c, d] > np.float32(0.998)  # more light would not be seen
            counted = weight[c, d]
            robust[c, d] = zero if full else counted * (freedom + one) / (freedom + left * left * counted)
            gain[c, d] = field[d] if zero < found < one else zero
            lit[c, d] = min(max(found, zero), one)
    return lit, robust, gain


@dataclass(frozen=True)
class Differing:
    """What tells whether the light differs between frames."""

    spread: float  # standard deviation of the frames' gains
    common: float  # mean loss over what noise leaves, in one light for all frames
    exposure: float  # … with an exposure for each
    own: float  # … and with a field for each
    mixed: float  # share of the squares left in one light that the frame before takes away

    @property
    def plausible(self) -> bool:
        """Whether it is worth a closer look."""
        return self.spread > _DIFFERS

    @property
    def light(self) -> FrameLight:
        """The least that frames need of their own."""
        if not self.plausible or self.exposure > _LEFT * self.common or self.mixed > MIXED:
            return STEADY
        more = self.exposure - self.own
        needed = more > max((1 - _LEFT) * self.exposure, _TRIFLE * (self.common - self.exposure))
        return FrameLight("field" if needed else "exposure")


def differing(mean: Tensor, real: Tensor, weight: Tensor, curve: Curve) -> Differing:
    """How frames [N, C, H, W] of a curve's values differ in light, beside a prediction in the light that all have."""
    grey, seen = mean.mean(1, keepdim=True), real.mean(1, keepdim=True)
    weight = weight.amax(1, keepdim=True) * (grey > _BLACK)
    lit = FrameLight("field").on(grey, seen, weight, curve)
    common = _common(lit, seen - grey, grey)
    scaled = FrameLight("exposure").on(common, seen, weight, curve)
    pixels = max(float((weight > 0).sum()), 1.0)
    one_light, exposure, own = (
        float(_robust((seen - each).square() * weight).sum()) / pixels for each in (common, scaled.mean, lit.mean)
    )
    spread, mixed = float(scaled.coefficients[:, 0].std()), of_frame_before(seen - common, common, weight > 0)
    return Differing(spread, one_light, exposure, own, mixed)


def _robust(squared: Tensor) -> Tensor:
    return (FREEDOM + 1) * torch.log1p(squared / FREEDOM)


def _common(lit: Lit, residual: Tensor, mean: Tensor) -> Tensor:
    """The prediction in one light for all frames."""
    frames = range(len(mean))
    matrices, vectors = zip(*(lit.equations(frame, residual[frame, None]) for frame in frames), strict=True)
    coefficients = torch.from_numpy(_solved(np.sum(matrices, 0), np.sum(vectors, 0)))
    added = torch.cat([lit.added(frame, coefficients) for frame in frames])
    return (mean + added).clamp(0, 1)


def stops(lit: Lit, encoding: Curve) -> np.ndarray:
    """The exposure [B] of each frame against the simulator's, EV: what its gain makes of a coded mid grey."""
    pedestal = PEDESTAL[encoding]
    grey = ((0.5 + pedestal) * (1 + lit.coefficients[:, 0]) - pedestal).clamp(min=0.01)
    light, before = (each if encoding == "linear" else to_linear(each) for each in (grey, torch.tensor(0.5)))
    return torch.log2(light / before).numpy()


def deciding_level(sizes: Sequence[tuple[int, int]]) -> int:
    """Which of the sizes (height, width), from large to small, light is decided on."""
    return next((k for k, size in enumerate(sizes) if min(size) <= _FINEST), len(sizes) - 1)
