"""Surfaces and light: what the real scene looks like where the rendered one differs, label by label.

In: a renderer's pictures with their labels, and where there is depth the normals of what they show. Out: the same
scene with other colours, grain or light, before any camera. An effect is a class in a file of `appearance/effects`.
"""

from vision_s2r.appearance import effects as _effects  # noqa: F401  (fills the registry)
from vision_s2r.appearance.apply import through
from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, AppearanceEffect, Lamp, Scene, is_appearance, label_of
from vision_s2r.camera import CAMERA_EFFECTS

PICTURE_EFFECTS = CAMERA_EFFECTS | APPEARANCE_EFFECTS  # all that a picture can differ by

__all__ = [
    "APPEARANCE_EFFECTS",
    "PICTURE_EFFECTS",
    "AppearanceEffect",
    "Lamp",
    "Scene",
    "is_appearance",
    "label_of",
    "through",
]
