"""Camera or scene move while the shutter is open."""

import math
from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.camera.resample import convolve, interpolation_weight
from vision_s2r.effects import Parameter

_PATH_POINTS = 128  # twice the greatest length, so that points stay within half a pixel of each other


@CAMERA_EFFECTS.register
class MotionBlur(CameraEffect):
    """The mean of the picture, on coded values, along a straight path of this length, centred on each pixel.

    Between pixels the picture is interpolated as in warps. Differentiable in picture and parameters.
    """

    name = "motion_blur"
    order = 80
    optical = True
    linear_light = False
    parameters = (
        Parameter("length", "px", low=0.0, high=64.0, neutral=0.0, moderate=7.0),
        Parameter("angle", "deg", low=-360.0, high=360.0, neutral=None, moderate=30.0),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        length, angle = values["length"], torch.deg2rad(values["angle"])
        reach = math.ceil(float(length.detach().max()) / 2) + (2 if frame.interpolation == "bicubic" else 1)
        pixel = torch.arange(-reach, reach + 1, dtype=length.dtype, device=length.device)
        points = (torch.arange(_PATH_POINTS, dtype=length.dtype, device=length.device) + 0.5) / _PATH_POINTS
        path = (points - 0.5) * length[:, None]
        x, y = (torch.cos(angle)[:, None] * path, torch.sin(angle)[:, None] * path)
        across = interpolation_weight(x[:, :, None] - pixel, frame.interpolation)
        down = interpolation_weight(y[:, :, None] - pixel, frame.interpolation)
        return convolve(images, down.mT @ across / _PATH_POINTS)
