"""The lens bends straight lines."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.camera.resample import warp
from vision_s2r.effects import Parameter

_NEWTON_STEPS = 4  # far from the fold, 1e-4 px


@CAMERA_EFFECTS.register
class LensDistortion(CameraEffect):
    """OpenCV's radial model: what stands at r appears at r·(1 + k1·r² + k2·r⁴), normalized coordinates.

    A strong barrel folds back at some radius, beyond which it shows nothing; there the fold's ring repeats.
    Differentiable in picture and parameters.
    """

    name = "lens_distortion"
    order = 40
    optical = True
    linear_light = False
    parameters = (
        Parameter("k1", "", low=-1.0, high=1.0, neutral=0.0, moderate=-0.2),
        Parameter("k2", "", low=-1.0, high=1.0, neutral=0.0, moderate=0.04),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        fx, fy, cx, cy = frame.intrinsics[:, :, None, None].unbind(1)
        x, y = frame.pixels()
        x, y = torch.broadcast_tensors((x - cx) / fx, (y - cy) / fy)
        k1, k2 = values["k1"][:, None, None], values["k2"][:, None, None]
        ratio = undistorted_ratio(x.square() + y.square(), k1, k2)
        return warp(images, fx * x * ratio + cx, fy * y * ratio + cy, frame)


def undistorted_ratio(distorted_squared: Tensor, k1: Tensor, k2: Tensor) -> Tensor:
    """Undistorted over distorted radius, given the square of the distorted one [B, H, W]; k1, k2 [B, 1, 1].

    The ratio u solves u·(1 + a·u² + b·u⁴) = 1, a = k1·r², b = k2·r⁴: Newton's method from u = 1, which for one
    sign of distortion approaches the root from one side. The steps are taken without gradient and a last one
    with it, which then is the implicit function's.
    """
    a, b = k1 * distorted_squared, k2 * distorted_squared.square()
    with torch.no_grad():
        limit = _fold_radius(k1, k2) / distorted_squared.sqrt().clamp(min=1e-6)
        ratio = torch.ones_like(a)
        for _ in range(_NEWTON_STEPS):
            ratio = torch.minimum(_newton(ratio, a, b), limit)
    if a.requires_grad or b.requires_grad:
        ratio = torch.minimum(_newton(ratio, a, b), limit)
    return ratio


def _newton(ratio: Tensor, a: Tensor, b: Tensor) -> Tensor:
    squared = ratio.square()
    quartic = b * squared
    slope = 1 + squared * (3 * a + 5 * quartic)
    return (1 + 2 * ratio * squared * (a + 2 * quartic)) / slope.clamp(min=0.05)


def _fold_radius(k1: Tensor, k2: Tensor) -> Tensor:
    """Smallest radius at which r·(1 + k1·r² + k2·r⁴) stops growing; infinite where it never does."""
    # 1 + 3·k1·s + 5·k2·s² = 0 in s = r², solved in the form that does not cancel at k2 = 0.
    root = (9 * k1.square() - 20 * k2).sqrt()  # NaN where there is no real root
    squared = 2 / (root - 3 * k1)
    return torch.where(squared > 0, squared, torch.inf).sqrt()
