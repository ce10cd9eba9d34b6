"""The camera's tone curve is another."""

from collections.abc import Mapping

from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.effects import Parameter

_BLACK = 1e-12  # keeps the slope of the power finite at 0


@CAMERA_EFFECTS.register
class Gamma(CameraEffect):
    """Coded value ^ gamma. Differentiable in picture and parameter, apart from black pixels."""

    name = "gamma"
    order = 140
    optical = False
    linear_light = False
    parameters = (Parameter("gamma", "", low=0.2, high=5.0, neutral=1.0, moderate=1.5, scale="log"),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        return images.clamp(min=_BLACK) ** per_image(values["gamma"])
