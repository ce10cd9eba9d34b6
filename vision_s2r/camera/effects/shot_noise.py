"""Light arrives in photons."""

import math
from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, per_image, straight_through
from vision_s2r.camera.noise import standard_normal
from vision_s2r.effects import Parameter

_FEW = 0.05  # electrons, below which there is one or none


@CAMERA_EFFECTS.register
class ShotNoise(CameraEffect):
    """Poisson noise of the electrons of a pixel, full_well of them at full scale, in linear light.

    The gradient in picture and full_well is that of the smooth quantile function, the counting passed
    straight through: good for means over many pixels, not to be believed pixel by pixel at a few electrons.
    """

    name = "shot_noise"
    order = 110
    optical = False
    linear_light = True
    parameters = (Parameter("full_well", "e-", low=10.0, high=1e6, neutral=math.inf, moderate=500.0, scale="log"),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        full_well = per_image(values["full_well"])
        return poisson_quantile(images * full_well, standard_normal(images, frame, self.order)) / full_well


def poisson_quantile(mean: Tensor, normal: Tensor) -> Tensor:
    """The Poisson variable of this mean at the quantile of a standard normal one, of one shape.

    From 0.05 on the asymptotic inverse of Giles 2016 (Algorithm 955, ACM TOMS 42:7, Q_N2): the total
    variation distance to Poisson is 0.02 at worst, 0.003 from a mean of 4 on. Below, one or none with the
    right mean.
    """
    enough = mean.clamp(min=_FEW)
    root = enough.sqrt()
    smooth = (
        enough + root * normal + (1 / 3 + normal.square() / 6) - (normal / 36 + normal.square() * normal / 72) / root
    )
    counted = smooth.detach().floor().clamp(min=0)
    few = mean < _FEW
    counted[few] = (torch.special.ndtr(normal[few]) > 1 - mean.detach()[few]).to(mean)
    return straight_through(counted, smooth)
