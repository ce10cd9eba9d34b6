"""Appearance effects on pictures, in the order of the light."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from torch import Tensor

from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, Scene, is_appearance, label_of


def in_order(names: Iterable[str]) -> list[str]:
    """The appearance effects among `names`, as light meets them."""
    return sorted(filter(is_appearance, names), key=lambda name: (APPEARANCE_EFFECTS[name].order, name))


def passed(light: Tensor, name: str, values: Mapping[str, float], scene: Scene) -> tuple[Tensor, Scene]:
    """Linear light [B, C, H, W] behind one effect, and the scene with the light that it then has."""
    label = label_of(name)
    region = scene.shares.sum(1, keepdim=True) if label is None else scene.region(label)
    return APPEARANCE_EFFECTS[name].apply(light, values, scene, region), after(scene, name, values)


def after(scene: Scene, name: str, values: Mapping[str, float]) -> Scene:
    """The scene with the light that it has behind one effect."""
    return scene if scene.lamp is None else replace(scene, lamp=APPEARANCE_EFFECTS[name].lamp(scene.lamp, values))


def through(light: Tensor, values: Mapping[str, Mapping[str, float]], scene: Scene) -> Tensor:
    """Linear light [B, C, H, W] behind all appearance effects among `values`; nothing is clipped."""
    for name in in_order(values):
        light, scene = passed(light, name, values[name], scene)
    return light
