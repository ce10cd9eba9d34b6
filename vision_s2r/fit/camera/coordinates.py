"""Effect parameters as the fit moves them, in the charts of `fit/camera/effects`."""

from collections.abc import Mapping, Sequence

import numpy as np

from vision_s2r.appearance import PICTURE_EFFECTS
from vision_s2r.fit.camera import effects as _effects  # noqa: F401  (fills CAMERA_FITS)
from vision_s2r.fit.camera.effect import CAMERA_FITS, Chart, EffectValues, Optics, Setting


def chart(name: str) -> Chart:
    """The coordinates of an effect that has some."""
    found = CAMERA_FITS[name].chart
    assert found is not None, name
    return found


def neutral(name: str, optics: Optics | None = None) -> Setting:
    """The effect switched off; what switches nothing is at its moderate value."""
    if optics is not None and name in optics.nominal:
        return dict(optics.nominal[name])
    parameters = PICTURE_EFFECTS[name].parameters
    return {each.name: each.moderate if each.neutral is None else each.neutral for each in parameters}


def starts(name: str, optics: Optics) -> list[Setting]:
    """Settings of an effect from which a fit finds any other, in pictures of this size."""
    found = CAMERA_FITS[name].starts
    if found is None:
        return [neutral(name, optics)]
    return [at_scale(name, setting, optics.pixel) for setting in found(optics.width)]


def at_scale(name: str, values: EffectValues, scale: float) -> Setting:
    """The effect in pictures of `scale` times the size."""
    sized = CAMERA_FITS[name].sized
    units = {parameter.name: parameter.unit for parameter in PICTURE_EFFECTS[name].parameters}
    return {key: value * scale if sized or units[key] == "px" else value for key, value in values.items()}


def bounded(name: str, values: EffectValues) -> dict[str, float]:
    """The nearest values within the effect's bounds."""
    effect = PICTURE_EFFECTS[name]
    return {
        key: min(max(value, effect.parameter(key).low), effect.parameter(key).high) for key, value in values.items()
    }


def at_bound(name: str, values: EffectValues) -> bool:
    """Whether a parameter sits at a bound at which the effect does not vanish."""
    parameters = [each for each in PICTURE_EFFECTS[name].parameters if each.neutral is not None]
    return any(values[each.name] in (each.low, each.high) and values[each.name] != each.neutral for each in parameters)


def pack(values: Mapping[str, EffectValues], names: Sequence[str]) -> np.ndarray:
    """The fit's coordinates [P] of these effects, in the order of `names`."""
    return np.array([x for name in names for x in chart(name).inward(values[name])])


def unpack(point: np.ndarray, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """The inverse of `pack`, within bounds."""
    values, at = {}, 0
    for name in names:
        size = sum(1 for _ in PICTURE_EFFECTS[name].parameters)
        values[name] = bounded(name, chart(name).outward([float(x) for x in point[at : at + size]]))
        at += size
    return values
