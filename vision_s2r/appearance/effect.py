"""What an effect of surfaces and light is, and what it may know of the scene that was rendered."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from vision_s2r.effects import Effect, Registry, Source, unqualified

_DARKEST = 0.02  # share of full shading: a surface that no light reaches has no ratio


@dataclass(frozen=True)
class Lamp:
    """One distant light over one without direction, as Lambert has it.

    `direction` is the unit vector towards the light in the camera's axes (x right, y down, z forward), `ambient` the
    share of the light that has no direction. `coded`: the renderer shades coded values, as those do that know no
    transfer function.
    """

    direction: tuple[float, float, float]
    ambient: float
    coded: bool = False

    def shading(self, normals: Tensor) -> Tensor:
        """Of full light, what surfaces with unit `normals` [B, 3, H, W] get [B, 1, H, W]."""
        facing = torch.einsum("bchw,c->bhw", normals, torch.tensor(self.direction).to(normals))[:, None]
        return (self.ambient + (1 - self.ambient) * facing.clamp(min=0)).clamp(min=_DARKEST)


@dataclass(frozen=True)
class Scene:
    """What was rendered in a batch of B pictures, beside their pixels."""

    labels: tuple[int, ...]  # those that occur
    shares: Tensor  # [B, labels, H, W]: the part of each pixel that is of a label
    normals: Tensor | None = None  # [B, 3, H, W] in the camera's axes, 0 where unknown
    lamp: Lamp | None = None  # the renderer's own light, where normals tell it
    encoding: str = "srgb"
    seeds: tuple[int, ...] = ()  # one a picture: what grain is a function of

    def region(self, label: int) -> Tensor:
        """The part [B, 1, H, W] of each pixel that is of the label."""
        if label not in self.labels:
            return torch.zeros_like(self.shares[:, :1])
        k = self.labels.index(label)
        return self.shares[:, k : k + 1]


class AppearanceEffect(Effect, ABC):
    """An effect of surfaces and light, which act before the camera, in linear light.

    To add one: a class in a file of `vision_s2r/appearance/effects`, decorated with `APPEARANCE_EFFECTS.register`; and
    what fitting needs of it, a `CameraFit` in `fit/camera/effects`. An effect of one label has a name for each:
    "2.albedo" is that of label 2.
    """

    source: ClassVar[Source] = "appearance"
    order: ClassVar[int]  # light passes the effects by increasing order
    labelled: ClassVar[bool]  # whether it is of one label

    @abstractmethod
    def apply(self, light: Tensor, values: Mapping[str, float], scene: Scene, region: Tensor) -> Tensor:
        """The effect on linear light [B, 1 or 3, H, W]; `region` [B, 1, H, W] is the share of its label in each pixel.

        `scene.lamp` is the light after the effects before. Nothing is clipped.
        """

    def lamp(self, lamp: Lamp, values: Mapping[str, float]) -> Lamp:
        """The light of the scene after the effect."""
        return lamp


APPEARANCE_EFFECTS: Registry[AppearanceEffect] = Registry("appearance")


def label_of(name: str) -> int | None:
    """The label that "2.albedo" is of; None for an effect of the whole scene."""
    part, dot, _ = name.rpartition(".")
    return int(part) if dot else None


def of_label(label: int, effect: str) -> str:
    """The name of an effect of one label."""
    return f"{label}.{effect}"


def is_appearance(name: str) -> bool:
    """Whether the effect of this name acts before the camera."""
    return unqualified(name) in APPEARANCE_EFFECTS


def direction(azimuth: float, elevation: float) -> tuple[float, float, float]:
    """Unit vector towards a light, in the camera's axes.

    `azimuth` (rad) turns from right towards down in the picture, `elevation` (rad) rises from the picture's plane
    towards the camera: at π/2 the light shines along the view.
    """
    flat = math.cos(elevation)
    return flat * math.cos(azimuth), flat * math.sin(azimuth), -math.sin(elevation)
