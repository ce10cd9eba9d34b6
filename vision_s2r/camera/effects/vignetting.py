"""The lens passes less light towards the corners."""

from collections.abc import Mapping

from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class Vignetting(CameraEffect):
    """Light × (1 − strength·r²/r²_corner), r from the picture's centre, r_corner at its corner pixels.

    Differentiable in picture and parameter.
    """

    name = "vignetting"
    order = 60
    optical = True
    linear_light = True
    parameters = (Parameter("strength", "", low=0.0, high=1.0, neutral=0.0, moderate=0.5),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        x, y = frame.from_centre()
        corner_squared = ((frame.width - 1) ** 2 + (frame.height - 1) ** 2) / 4
        return images * (1 - per_image(values["strength"]) * ((x * x + y * y) / corner_squared))
