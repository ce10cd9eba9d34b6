"""The light comes from elsewhere."""

import math
from collections.abc import Mapping
from dataclasses import replace

from torch import Tensor

from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, AppearanceEffect, Lamp, Scene, direction
from vision_s2r.appearance.lamp import relit
from vision_s2r.effects import Parameter


@APPEARANCE_EFFECTS.register
class LightDirection(AppearanceEffect):
    """Lambert's shading under a light from (azimuth, elevation) in the place of the simulator's own.

    Azimuth turns from right towards down in the picture; elevation rises from the picture's plane towards the camera.
    """

    name = "light_direction"
    order = 10
    labelled = False
    parameters = (
        Parameter("azimuth", "rad", low=-2 * math.pi, high=2 * math.pi, neutral=None, moderate=0.5),
        Parameter("elevation", "rad", low=-1.5, high=math.pi / 2, neutral=None, moderate=0.8),
    )

    def apply(self, light: Tensor, values: Mapping[str, float], scene: Scene, region: Tensor) -> Tensor:
        return light if scene.lamp is None else relit(light, scene, self.lamp(scene.lamp, values))

    def lamp(self, lamp: Lamp, values: Mapping[str, float]) -> Lamp:
        return replace(lamp, direction=direction(values["azimuth"], values["elevation"]))
