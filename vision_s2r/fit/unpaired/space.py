"""What is fitted: the coordinates of effects, where fits start, and what is too little to matter."""

import math
from collections.abc import Sequence

import numpy as np

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.fit.camera.coordinates import bounded, neutral
from vision_s2r.fit.camera.effect import CAMERA_FITS, Chart, EffectValues, Optics, Setting, UnpairedFit
from vision_s2r.fit.case import Values


def shown() -> dict[str, UnpairedFit]:
    """The effects that sets without pairs show."""
    return {name: fit.unpaired for name, fit in CAMERA_FITS.items() if isinstance(fit.unpaired, UnpairedFit)}


def chart(name: str) -> Chart:
    """The coordinates of an effect that has some."""
    found = shown()[name].chart
    assert found is not None, name
    return found


def stepped() -> list[str]:
    """The effects that go by whole numbers, in the order in which they are fitted."""
    fits = shown()
    return sorted((name for name, fit in fits.items() if fit.chart is None), key=lambda name: fits[name].turn)


def pack(values: Values, names: Sequence[str]) -> np.ndarray:
    """Coordinates [P] of these effects, in the order of `names`."""
    return np.array([x for name in names for x in chart(name).inward(values[name])])


def unpack(point: np.ndarray, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """The inverse of `pack`, within bounds."""
    values, at = {}, 0
    for name in names:
        size = len(CAMERA_EFFECTS[name].parameters)
        values[name] = bounded(name, chart(name).outward([float(x) for x in point[at : at + size]]))
        at += size
    return values


def steps(names: Sequence[str], optics: Optics) -> tuple[np.ndarray, np.ndarray]:
    """Of each coordinate a change that shows, and the longest move of one iteration in such steps."""
    small = [step for name in names for step in chart(name).steps(optics)]
    return np.array(small), np.array([limit for name in names for limit in chart(name).limits])


def starts(name: str, width: int) -> list[Setting]:
    """Settings from which a fit finds any other; one alone where the effect is smooth at its neutral value."""
    found = shown()[name].starts
    return [neutral(name)] if found is None else found(width)


def wholes(name: str, width: int) -> tuple[int, int]:
    """The least and the most of an effect that goes by whole numbers: cells a row, or a quality."""
    if name == "low_resolution":
        return max(2, math.ceil(width / CAMERA_EFFECTS[name].parameter("factor").high)), width
    return 1, 100


def to_whole(name: str, values: EffectValues, width: int) -> int:
    """The whole number of an effect that goes by them."""
    return round(width / values["factor"] if name == "low_resolution" else values["quality"])


def of_whole(name: str, whole: float, width: int) -> dict[str, float]:
    """The inverse of `to_whole`, for halves too."""
    return {"factor": width / whole} if name == "low_resolution" else {"quality": float(whole)}


def smooth(name: str) -> bool:
    """Whether the statistics have a slope along the effect at its neutral value."""
    return shown()[name].starts is None


def negligible(name: str, values: EffectValues, width: int) -> bool:
    """Whether the effect is smaller than what any simulator gets wrong."""
    return shown()[name].negligible(values, width)


def at_bound(name: str, values: EffectValues) -> bool:
    """Whether a parameter that has a size lies at the end of what is possible."""
    effect = CAMERA_EFFECTS[name]
    sized = [p for p in effect.parameters if p.neutral is not None]
    return any(value != p.neutral and (value <= p.low or value >= p.high) for p in sized for value in (values[p.name],))
