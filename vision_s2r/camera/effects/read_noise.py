"""Reading the sensor out adds noise of its own."""

from collections.abc import Mapping

from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image
from vision_s2r.camera.noise import standard_normal
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class ReadNoise(CameraEffect):
    """Gaussian noise, independent for each pixel and channel, in linear light.

    Differentiable in picture and sigma: the noise is sigma times fixed draws (reparametrization).
    """

    name = "read_noise"
    order = 120
    optical = False
    linear_light = True
    parameters = (Parameter("sigma", "fraction of full scale", low=0.0, high=0.5, neutral=0.0, moderate=0.01),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        return images + per_image(values["sigma"]) * standard_normal(images, frame, self.order)
