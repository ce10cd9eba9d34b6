"""The lens magnifies the colours differently."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.camera.resample import warp
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class ChromaticAberration(CameraEffect):
    """Lateral: the red and blue channels sample at r·(1 + value), r the radius from the principal point.

    Green stays. Differentiable in picture and parameters.
    """

    name = "chromatic_aberration"
    order = 50
    optical = True
    linear_light = False
    parameters = (
        Parameter("red", "", low=-0.2, high=0.2, neutral=0.0, moderate=0.02),
        Parameter("blue", "", low=-0.2, high=0.2, neutral=0.0, moderate=-0.02),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        cx, cy = frame.intrinsics[:, 2, None, None], frame.intrinsics[:, 3, None, None]
        x, y = frame.pixels()

        def scaled(channel: Tensor, value: Tensor) -> Tensor:
            scale = 1 + value[:, None, None]
            source_x, source_y = torch.broadcast_tensors((x - cx) * scale + cx, (y - cy) * scale + cy)
            return warp(channel, source_x, source_y, frame)

        red, green, blue = images.split(1, dim=1)
        return torch.cat([scaled(red, values["red"]), green, scaled(blue, values["blue"])], dim=1)
