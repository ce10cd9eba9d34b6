"""Light that differs from frame to frame: a nuisance, fitted to each frame alone and alike under every hypothesis.

A photograph has the exposure and the light of its moment. Where these differ between frames, no constant effect is the
cause, and whatever is fitted without them bends to make up for them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from vision_s2r.camera.colour import to_linear

UNSTEADY = "light that differs from frame to frame"

Kind = Literal["steady", "exposure", "field"]

_ROBUST = 6.0  # degrees of freedom of the weights: a hand before the board is no light
_PASSES = 3  # of reweighting
_RIDGE = 1e-5  # of the mean curvature: a frame that shows one grey has no veil of its own
_POINTS = 20_000  # of a frame, that its light is fitted to, at most
_DIFFERS = 0.03  # standard deviation of the frames' gains, from which light may be said to differ
_LEFT = 0.8  # of what a simpler light leaves: one that is more the frames' own has to leave less than this
_BLACK = 0.05  # of full scale: values below it say nothing of light, noise and a sensor's offset move them
LEAST_FRAMES = 3  # that have a spread
_FINEST = 80  # px of the shorter side, of the pictures on which it is decided


@dataclass(frozen=True)
class Lit:
    """Predictions [B, C, H, W] in the light of each frame."""

    mean: Tensor
    basis: Tensor  # [B, K, C·H·W]: what the light may add to the prediction
    gain: Tensor  # [B, C, H, W]: what it multiplies it by; nothing where the sensor is full
    weight: Tensor  # [B, 1, C·H·W]
    coefficients: Tensor  # [B, K]

    def beside(self, slopes: Tensor) -> Tensor:
        """Changes of the unlit prediction [P, B, C, H, W] as lit, less what light would make up for."""
        lit = (slopes * self.gain).flatten(2)  # [P, B, CHW]
        made_up = _solved(self.basis, self.weight, lit.transpose(0, 1)) @ self.basis  # [B, P, CHW]
        return (lit - made_up.transpose(0, 1)).view_as(slopes)


@dataclass(frozen=True)
class FrameLight:
    """What frames have of their own: an exposure, or a smooth field of gain and a veil over it."""

    kind: Kind

    def on(self, mean: Tensor, real: Tensor, weight: Tensor) -> Lit:
        """The likeliest light of each frame: `mean` and `real` [B, C, H, W], `weight` [B, 1 or C, H, W], 0 unseen.

        Least squares under Student's weights; a frame's light is its own, whatever frames are asked for together.
        """
        frames = zip(mean.split(1), real.split(1), weight.expand_as(mean).split(1), strict=True)
        found = [self._frame(*each) for each in frames]
        return Lit(
            torch.cat([each.mean for each in found]),
            torch.cat([each.basis for each in found]),
            torch.cat([each.gain for each in found]),
            torch.cat([each.weight for each in found]),
            torch.cat([each.coefficients for each in found]),
        )

    def _frame(self, mean: Tensor, real: Tensor, weight: Tensor) -> Lit:
        waves = self._waves(mean)
        basis = torch.cat([(mean * wave).flatten(1)[:, None] for wave in waves], 1)
        if self.kind == "field":
            basis = torch.cat([basis, torch.ones_like(basis[:, :1])], 1)
        whole = basis, mean.flatten(1), real.flatten(1), weight.flatten(1)
        stride = max(mean[0].numel() // _POINTS, 1) | 1  # odd, so that all columns are met
        few = tuple(each[..., ::stride].contiguous() for each in whole)
        robust = few[-1]
        for k in range(_PASSES):
            coefficients = _solved(few[0], robust[:, None], (few[2] - few[1])[:, None])[:, 0]
            last = k == _PASSES - 1
            robust, added = _forgiving(coefficients, *(whole if last else few))
        lit = mean + added.view_as(mean)
        gain = sum((c * wave for c, wave in zip(coefficients[0], waves, strict=False)), torch.ones(1, 1, 1, 1))
        gain = gain * ((lit > 0) & (lit < 1))
        return Lit(lit.clamp(0, 1), basis, gain, robust[:, None], coefficients)

    def _waves(self, like: Tensor) -> list[Tensor]:
        """Polynomials [1, 1, H, W] in the place, up to the second order; the constant alone of an exposure."""
        one = torch.ones(1, 1, 1, 1)
        if self.kind != "field":
            return [one]
        y = torch.linspace(-1, 1, like.shape[-2])[:, None].expand(like.shape[-2:])[None, None]
        x = torch.linspace(-1, 1, like.shape[-1]).expand(like.shape[-2:])[None, None]
        return [one, x, y, x * x, x * y, y * y]


STEADY = FrameLight("steady")


def _solved(basis: Tensor, weight: Tensor, targets: Tensor) -> Tensor:
    """Weighted least squares: coefficients [B, P, K] of `basis` [B, K, D] for `targets` [B, P, D]."""
    weighed = basis * weight
    matrix = (weighed @ basis.mT).double()
    ridge = _RIDGE * matrix.diagonal(dim1=1, dim2=2).mean(1)[:, None, None] + 1e-12
    vectors = (weighed @ targets.mT).double()
    found = torch.linalg.solve(matrix + ridge * torch.eye(matrix.shape[-1], dtype=torch.float64), vectors)
    return found.mT.float()


def _forgiving(
    coefficients: Tensor, basis: Tensor, mean: Tensor, real: Tensor, weight: Tensor
) -> tuple[Tensor, Tensor]:
    """Weights [B, D] that forgive single values what light of these coefficients leaves, and what the light adds."""
    added = (coefficients[:, None] @ basis)[:, 0]
    left = real - mean - added
    full = (mean + added >= 1) & (real > 0.998)  # more light would not be seen
    return torch.where(full, 0.0, weight * (_ROBUST + 1) / (_ROBUST + left.square() * weight)), added


@dataclass(frozen=True)
class Differing:
    """What tells whether the light differs between frames."""

    spread: float  # standard deviation of the frames' gains
    common: float  # mean loss over what noise leaves, in one light for all frames
    exposure: float  # … with an exposure for each
    own: float  # … and with a field for each

    @property
    def plausible(self) -> bool:
        """Whether it is worth a closer look."""
        return self.spread > _DIFFERS

    @property
    def light(self) -> FrameLight:
        """The least that frames need of their own."""
        if not self.plausible or self.exposure > _LEFT * self.common:
            return STEADY
        return FrameLight("field") if self.own < _LEFT * self.exposure else FrameLight("exposure")


def differing(mean: Tensor, real: Tensor, weight: Tensor) -> Differing:
    """How frames [N, C, H, W] differ in light, beside a prediction in the light that all have alike."""
    grey, seen = mean.mean(1, keepdim=True), real.mean(1, keepdim=True)
    weight = weight.amax(1, keepdim=True) * (grey > _BLACK)
    lit = FrameLight("field").on(grey, seen, weight)
    common = _common(lit, seen - grey, grey)
    scaled = FrameLight("exposure").on(common, seen, weight)
    pixels = max(float((weight > 0).sum()), 1.0)
    losses = [
        float(_robust((seen - each).square() * weight).sum()) / pixels for each in (common, scaled.mean, lit.mean)
    ]
    return Differing(float(scaled.coefficients[:, 0].std()), *losses)


def _robust(squared: Tensor) -> Tensor:
    return (_ROBUST + 1) * torch.log1p(squared / _ROBUST)


def _common(lit: Lit, residual: Tensor, mean: Tensor) -> Tensor:
    """The prediction in one light for all frames."""
    basis, weight = (each.transpose(0, 1).flatten(1)[None] for each in (lit.basis, lit.weight))
    coefficients = _solved(basis, weight, residual.flatten()[None, None])
    return (mean + (coefficients @ basis).view_as(mean)).clamp(0, 1)


def stops(lit: Lit, encoding: str) -> np.ndarray:
    """The exposure [B] of each frame against the simulator's, EV: what its gain makes of a coded mid grey."""
    grey = (0.5 * (1 + lit.coefficients[:, 0])).clamp(min=0.01)
    light, before = (each if encoding == "linear" else to_linear(each) for each in (grey, torch.tensor(0.5)))
    return torch.log2(light / before).numpy()


def deciding_level(sizes: Sequence[tuple[int, int]]) -> int:
    """Which of the sizes (height, width), from large to small, light is decided on."""
    return next((k for k, size in enumerate(sizes) if min(size) <= _FINEST), len(sizes) - 1)
