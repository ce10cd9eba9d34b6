"""The scene is out of focus."""

import math
from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.camera.resample import convolve
from vision_s2r.effects import Parameter

_SUBPIXELS = 4  # a pixel's coverage is measured on so many points along each axis
_SMALLEST = 0.25  # px: a disk that still covers some of these points


@CAMERA_EFFECTS.register
class DefocusBlur(CameraEffect):
    """The mean over a disk, on coded values. A pixel weighs what the disk covers of it.

    A disk of at most half a pixel covers nothing but its own pixel. Differentiable in picture and radius.
    """

    name = "defocus_blur"
    order = 70
    optical = True
    linear_light = False
    parameters = (Parameter("radius", "px", low=0.0, high=32.0, neutral=0.0, moderate=2.0),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        return convolve(images, disk_kernels(values["radius"]))


def disk_kernels(radius: Tensor) -> Tensor:
    """Pixel coverage [B, K, K] by disks of `radius` [B] px; their rim is one subpixel wide, and linear."""
    reach = math.ceil(max(float(radius.detach().max()), 0.5))
    size = 2 * reach + 1
    fine = torch.arange(size * _SUBPIXELS, dtype=radius.dtype, device=radius.device)
    position = (fine + 0.5) / _SUBPIXELS - size / 2
    distance = torch.hypot(position[:, None], position)
    inside = ((radius.clamp(min=_SMALLEST)[:, None, None] - distance) * _SUBPIXELS + 0.5).clamp(0, 1)
    return inside.reshape(-1, size, _SUBPIXELS, size, _SUBPIXELS).mean((2, 4))
