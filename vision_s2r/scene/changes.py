"""The real look with one thing about its light or its surfaces changed, by how much: 0 not at all, 1 moderately."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

from vision_s2r.errors import UserError, nearest
from vision_s2r.scene.appearance import Appearance

Change = Callable[[Appearance, float], Appearance]

LOWEST = 1.5  # rad from the zenith: nearly along the table
LOWER = 0.15  # rad a unit
HARDER = 0.4  # of the ambient light that goes a unit
GLOSS = 0.5  # of specular light that comes a unit
ALIKE = 0.5  # share of the objects a unit


def _low_light(look: Appearance, strength: float) -> Appearance:
    """The light stands LOWER rad lower a unit, and throws longer shadows."""
    x, y, z = look.light.direction
    angle = min(math.atan2(math.hypot(x, y), z) + LOWER * strength, LOWEST)
    turn = math.atan2(y, x)
    towards = (math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle))
    return replace(look, light=replace(look.light, direction=towards))


def _dim_light(look: Appearance, strength: float) -> Appearance:
    """All light halves a unit: one stop."""
    share = 0.5**strength
    light = replace(look.light, ambient=share * look.light.ambient, diffuse=share * look.light.diffuse)
    return replace(look, light=light)


def _hard_light(look: Appearance, strength: float) -> Appearance:
    """HARDER of the light without direction is missing a unit: shadows and shaded sides turn black."""
    share = max(1 - HARDER * strength, 0.0)
    return replace(look, light=replace(look.light, ambient=share * look.light.ambient))


def _gloss(look: Appearance, strength: float) -> Appearance:
    """Highlights gain GLOSS a unit, on whatever is not dull."""
    return replace(look, light=replace(look.light, specular=look.light.specular + GLOSS * strength))


def _camouflage(look: Appearance, strength: float) -> Appearance:
    """ALIKE of the objects a unit, the first ones, are made of what the bin's floor is made of."""
    count = round(min(ALIKE * strength, 1.0) * len(look.objects))
    return replace(look, objects=(look.parts["bin_floor"],) * count + look.objects[count:])


CHANGES: Mapping[str, Change] = {
    "low_light": _low_light,
    "dim_light": _dim_light,
    "hard_light": _hard_light,
    "gloss": _gloss,
    "camouflage": _camouflage,
}


def known(names: Iterable[str]) -> None:
    """Raises UserError, with the nearest name, for a change that there is none of."""
    for name in names:
        if name not in CHANGES:
            raise UserError(f"no change of the look '{name}', {nearest(name, CHANGES)}")


def changed(look: Appearance, strengths: Mapping[str, float]) -> Appearance:
    """A look after these changes, by name."""
    for name, strength in strengths.items():
        look = CHANGES[name](look, strength)
    return look
