"""The scene is lit more from one side."""

from collections.abc import Mapping

from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class UnevenIllumination(CameraEffect):
    """Light × (1 + strength·t), t the distance along the direction, ±1 at half the width from the centre.

    Differentiable in picture and parameters.
    """

    name = "uneven_illumination"
    order = 20
    optical = True
    linear_light = True
    parameters = (
        Parameter("strength", "", low=-1.0, high=1.0, neutral=0.0, moderate=0.4),
        Parameter("angle", "deg", low=-360.0, high=360.0, neutral=None, moderate=30.0),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        distance = frame.along(values["angle"]) / (frame.width / 2)
        return images * (1 + per_image(values["strength"]) * distance)
