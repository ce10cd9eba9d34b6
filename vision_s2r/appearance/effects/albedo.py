"""A surface is of another colour."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, AppearanceEffect, Scene
from vision_s2r.effects import Parameter


@APPEARANCE_EFFECTS.register
class Albedo(AppearanceEffect):
    """Linear light × (red, green, blue) on the pixels of one label."""

    name = "albedo"
    order = 30
    labelled = True
    parameters = tuple(
        Parameter(channel, "", low=0.02, high=50.0, neutral=1.0, moderate=moderate, scale="log")
        for channel, moderate in (("red", 0.6), ("green", 0.7), ("blue", 0.8))
    )

    def apply(self, light: Tensor, values: Mapping[str, float], scene: Scene, region: Tensor) -> Tensor:
        gains = torch.tensor([values["red"], values["green"], values["blue"]]).to(light)
        if light.shape[1] == 1:
            gains = gains.mean(0, keepdim=True)
        return light * (1 + region * (gains[:, None, None] - 1))
