"""A camera effect of another package: an amplifier that glows at a corner. Everything about it is in this file."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.effects import Parameter
from vision_s2r.fit.camera.effect import CAMERA_FITS, CameraFit, plain


@CAMERA_EFFECTS.register
class AmpGlow(CameraEffect):
    """Light + strength·exp(−5·d/width), d the distance from the upper left corner."""

    name = "amp_glow"
    order = 95
    optical = False
    linear_light = True
    parameters = (Parameter("strength", "", low=0.0, high=2.0, neutral=0.0, moderate=0.4),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        x, y = frame.pixels()
        return images + per_image(values["strength"]) * torch.exp(-5 * torch.hypot(x, y) / frame.width)


CAMERA_FITS.register(
    "amp_glow",
    CameraFit(
        stage="light",
        chart=plain(("strength",), lambda optics: [0.02], [20]),
        coarse=0.0,
        confusable=frozenset({"vignetting"}),
        unpaired="without pairs a glow cannot be told from a scene's own light",
    ),
)
