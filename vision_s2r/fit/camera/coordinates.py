"""Effect parameters as the fit moves them: smooth where the effect vanishes, with a step for differences each."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vision_s2r.camera import CAMERA_EFFECTS

Point = list[float]  # one effect in the fit's coordinates
EffectValues = Mapping[str, float]


@dataclass(frozen=True)
class Optics:
    """What coordinates depend on: the size of the pictures and the focal length, px."""

    width: int
    height: int
    focal: float


@dataclass(frozen=True)
class Chart:
    """The fit's coordinates of one effect."""

    inward: Callable[[EffectValues], Point]
    outward: Callable[[Point], dict[str, float]]  # not yet within bounds
    steps: Callable[[Optics], Point]  # a change that shows, of each coordinate; also the scale of the damping
    limits: Point  # the longest move of one iteration, in steps


def _plain(name: str, steps: Callable[[Optics], Point], limits: Point, logarithmic: bool = False) -> Chart:
    keys = [parameter.name for parameter in CAMERA_EFFECTS[name].parameters]
    if logarithmic:
        return Chart(
            lambda values: [math.log(values[key]) for key in keys],
            lambda point: {key: math.exp(min(max(x, -20.0), 20.0)) for key, x in zip(keys, point, strict=True)},
            steps,
            limits,
        )
    return Chart(
        lambda values: [values[key] for key in keys],
        lambda point: dict(zip(keys, point, strict=True)),
        steps,
        limits,
    )


def _polar(size: str, turns: float, steps: Callable[[Optics], Point], limits: Point) -> Chart:
    """A size and an angle as the vector of that length; `turns` 2 where an angle and its opposite are the same."""

    def inward(values: EffectValues) -> Point:
        angle = math.radians(values["angle"]) * turns
        return [values[size] * math.cos(angle), values[size] * math.sin(angle)]

    def outward(point: Point) -> dict[str, float]:
        return {size: math.hypot(*point), "angle": math.degrees(math.atan2(point[1], point[0])) / turns}

    return Chart(inward, outward, steps, limits)


def _shadow() -> Chart:
    keys = ("strength", "offset", "angle")
    return Chart(
        lambda values: [*(values[key] for key in keys), math.log(values["softness"])],
        lambda point: dict(zip(keys, point, strict=False)) | {"softness": math.exp(min(max(point[3], -4.6), 6.9))},
        lambda optics: [0.02, 0.004 * optics.width, 1.0, 0.06],
        [15, 40, 25, 15],
    )


CHARTS: dict[str, Chart] = {
    "camera_pose_offset": _plain(
        "camera_pose_offset",
        lambda optics: [0.2 / optics.focal, 0.2 / optics.focal, 0.4 / optics.width],
        [40, 40, 40],
    ),
    "uneven_illumination": _polar("strength", 1.0, lambda optics: [0.02, 0.02], [30, 30]),
    "cast_shadow": _shadow(),
    "lens_distortion": _plain(
        "lens_distortion",
        lambda optics: [
            0.2 / optics.focal / (corner := math.hypot(optics.width, optics.height) / 2 / optics.focal) ** 3,
            0.2 / optics.focal / corner**5,
        ],
        [60, 60],
    ),
    "chromatic_aberration": _plain("chromatic_aberration", lambda optics: [0.3 / optics.width] * 2, [30, 30]),
    "vignetting": _plain("vignetting", lambda optics: [0.02], [30]),
    "defocus_blur": _plain("defocus_blur", lambda optics: [0.06], [20]),
    "motion_blur": _polar("length", 2.0, lambda optics: [0.12, 0.12], [20, 20]),
    "exposure": _plain("exposure", lambda optics: [0.02], [60]),
    "white_balance": _plain("white_balance", lambda optics: [0.01, 0.01], [40, 40], logarithmic=True),
    "gamma": _plain("gamma", lambda optics: [0.01], [40], logarithmic=True),
}


def bounded(name: str, values: EffectValues) -> dict[str, float]:
    """The nearest values within the effect's bounds."""
    effect = CAMERA_EFFECTS[name]
    return {
        key: min(max(value, effect.parameter(key).low), effect.parameter(key).high) for key, value in values.items()
    }


def pack(values: Mapping[str, EffectValues], names: Sequence[str]) -> np.ndarray:
    """The fit's coordinates [P] of these effects, in the order of `names`."""
    return np.array([x for name in names for x in CHARTS[name].inward(values[name])])


def unpack(point: np.ndarray, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """The inverse of `pack`, within bounds."""
    values, at = {}, 0
    for name in names:
        size = sum(1 for _ in CAMERA_EFFECTS[name].parameters)
        values[name] = bounded(name, CHARTS[name].outward([float(x) for x in point[at : at + size]]))
        at += size
    return values
