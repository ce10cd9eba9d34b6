"""What is fitted: the coordinates of effects, where fits start, and what is too little to matter."""

import math
from collections.abc import Sequence

import numpy as np

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.fit.camera.coordinates import CHARTS as MEAN_CHARTS
from vision_s2r.fit.camera.coordinates import Chart, EffectValues, Optics, bounded
from vision_s2r.fit.case import Values

CHARTS: dict[str, Chart] = {
    name: MEAN_CHARTS[name]
    for name in (
        "uneven_illumination",
        "vignetting",
        "defocus_blur",
        "motion_blur",
        "exposure",
        "white_balance",
        "gamma",
    )
} | {
    "read_noise": Chart(
        lambda values: [math.log(max(values["sigma"], 3e-4))],
        lambda point: {"sigma": math.exp(min(max(point[0], -8.1), 0.0))},
        lambda optics: [0.05],
        [20.0],
    ),
    "shot_noise": Chart(
        lambda values: [math.log(values["full_well"])],
        lambda point: {"full_well": math.exp(min(max(point[0], 0.0), 20.0))},
        lambda optics: [0.1],
        [20.0],
    ),
}
SILENT = {
    "camera_pose_offset": "without pairs nothing says where a thing should appear",
    "lens_distortion": "without pairs nothing says which lines are straight",
    "chromatic_aberration": "without pairs nothing says where a colour's edge should appear",
    "cast_shadow": "without pairs a soft shadow cannot be told from a scene's own light",
}
TWINS = (
    frozenset({"defocus_blur", "motion_blur", "low_resolution"}),
    frozenset({"read_noise", "shot_noise"}),
    frozenset({"exposure", "gamma"}),
    frozenset({"exposure", "vignetting"}),
)
_NEGLIGIBLE = {
    "uneven_illumination": ("strength", 0.01),
    "vignetting": ("strength", 0.01),
    "defocus_blur": ("radius", 0.55),  # a disk within its pixel is no blur
    "motion_blur": ("length", 0.4),
    "exposure": ("stops", 0.01),
    "read_noise": ("sigma", 1e-3),
}


def pack(values: Values, names: Sequence[str]) -> np.ndarray:
    """Coordinates [P] of these effects, in the order of `names`."""
    return np.array([x for name in names for x in CHARTS[name].inward(values[name])])


def unpack(point: np.ndarray, names: Sequence[str]) -> dict[str, dict[str, float]]:
    """The inverse of `pack`, within bounds."""
    values, at = {}, 0
    for name in names:
        size = len(CAMERA_EFFECTS[name].parameters)
        values[name] = bounded(name, CHARTS[name].outward([float(x) for x in point[at : at + size]]))
        at += size
    return values


def steps(names: Sequence[str], optics: Optics) -> tuple[np.ndarray, np.ndarray]:
    """Of each coordinate a change that shows, and the longest move of one iteration in such steps."""
    small = [step for name in names for step in CHARTS[name].steps(optics)]
    return np.array(small), np.array([limit for name in names for limit in CHARTS[name].limits])


def starts(name: str, width: int) -> list[dict[str, float]]:
    """Settings from which a fit finds any other; one alone where the effect is smooth at its neutral value."""
    if name == "defocus_blur":
        return [{"radius": radius} for radius in (0.8, 1.3, 2.2, 3.6, 6.0)]
    if name == "motion_blur":
        return [{"length": r, "angle": a} for r in (2.0, 4.5, 10.0) for a in (0.0, 45.0, 90.0, 135.0)]
    if name == "low_resolution":
        return [{"factor": width / round(width / factor)} for factor in (1.1, 1.3, 1.6, 2.0, 2.6, 3.4, 4.5, 6.5)]
    if name == "read_noise":
        return [{"sigma": sigma} for sigma in (0.002, 0.006, 0.018, 0.05)]
    if name == "shot_noise":
        return [{"full_well": well} for well in (3e4, 5e3, 800.0, 150.0, 40.0)]
    if name == "jpeg_compression":
        return [{"quality": quality} for quality in (92.0, 80.0, 60.0, 35.0, 15.0)]
    return [{p.name: p.moderate if p.neutral is None else p.neutral for p in CAMERA_EFFECTS[name].parameters}]


def smooth(name: str) -> bool:
    """Whether the statistics have a slope along the effect at its neutral value."""
    return len(starts(name, 128)) == 1


def negligible(name: str, values: EffectValues, width: int) -> bool:
    """Whether the effect is smaller than what any simulator gets wrong."""
    if name in _NEGLIGIBLE:
        key, limit = _NEGLIGIBLE[name]
        return abs(values[key]) < limit
    if name == "low_resolution":
        return round(width / values["factor"]) >= width
    if name in ("white_balance", "gamma"):
        return all(abs(math.log(value)) < 0.004 for value in values.values())
    return name == "shot_noise" and values["full_well"] > 2e5


def at_bound(name: str, values: EffectValues) -> bool:
    """Whether a parameter that has a size lies at the end of what is possible."""
    effect = CAMERA_EFFECTS[name]
    sized = [p for p in effect.parameters if p.neutral is not None]
    return any(value != p.neutral and (value <= p.low or value >= p.high) for p in sized for value in (values[p.name],))
