"""The camera takes another light for white."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class WhiteBalance(CameraEffect):
    """Gains of red and blue on coded values, green = 1. Differentiable in picture and parameters."""

    name = "white_balance"
    order = 130
    optical = False
    linear_light = False
    parameters = (
        Parameter("red", "", low=0.1, high=10.0, neutral=1.0, moderate=1.2, scale="log"),
        Parameter("blue", "", low=0.1, high=10.0, neutral=1.0, moderate=0.8, scale="log"),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        gains = torch.stack([values["red"], torch.ones_like(values["red"]), values["blue"]], dim=1)
        return images * gains[:, :, None, None]
