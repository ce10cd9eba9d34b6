"""Something outside the picture casts a shadow into it."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class CastShadow(CameraEffect):
    """Light × (1 − strength·σ((d − offset)/softness)): a soft half-plane of shadow, fixed in the picture.

    σ is the logistic function, d the distance (px) from the centre along the direction `angle`.
    Differentiable in picture and parameters.
    """

    name = "cast_shadow"
    order = 30
    optical = True
    linear_light = True
    parameters = (
        Parameter("strength", "", low=0.0, high=1.0, neutral=0.0, moderate=0.5),
        Parameter("offset", "px", low=-4096.0, high=4096.0, neutral=None, moderate=0.0),
        Parameter("angle", "deg", low=-360.0, high=360.0, neutral=None, moderate=20.0),
        Parameter("softness", "px", low=0.01, high=1024.0, neutral=None, moderate=5.0, scale="log"),
    )

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        depth = (frame.along(values["angle"]) - per_image(values["offset"])) / per_image(values["softness"])
        return images * (1 - per_image(values["strength"]) * torch.sigmoid(depth))
