"""More or less of the light has no direction."""

from collections.abc import Mapping
from dataclasses import replace

from torch import Tensor

from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, AppearanceEffect, Lamp, Scene
from vision_s2r.appearance.lamp import relit
from vision_s2r.effects import Parameter


@APPEARANCE_EFFECTS.register
class Ambient(AppearanceEffect):
    """Lambert's shading with this share of light without direction in the place of the simulator's own.

    A surface that faces the light is as bright as before.
    """

    name = "ambient"
    order = 20
    labelled = False
    parameters = (Parameter("share", "", low=0.0, high=1.0, neutral=None, moderate=0.6),)

    def apply(self, light: Tensor, values: Mapping[str, float], scene: Scene, region: Tensor) -> Tensor:
        return light if scene.lamp is None else relit(light, scene, self.lamp(scene.lamp, values))

    def lamp(self, lamp: Lamp, values: Mapping[str, float]) -> Lamp:
        return replace(lamp, ambient=values["share"])
