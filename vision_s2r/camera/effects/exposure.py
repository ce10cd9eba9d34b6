"""The exposure time or the gain is another."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class Exposure(CameraEffect):
    """Light × 2^stops, clipped where the sensor is full. Differentiable in picture and parameter."""

    name = "exposure"
    order = 100
    optical = False
    linear_light = True
    parameters = (Parameter("stops", "EV", low=-6.0, high=6.0, neutral=0.0, moderate=-1.0),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        return images * per_image(torch.exp2(values["stops"]))
