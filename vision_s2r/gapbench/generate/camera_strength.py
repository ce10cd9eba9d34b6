"""How strong each camera effect may be: for each a random family, from nothing (0) to severe (1)."""

import math
from collections.abc import Callable

import numpy as np

from vision_s2r.gapbench.generate.camera_effects import Geometry

Rng = np.random.Generator
Family = Callable[[float], dict[str, float]]  # intensity in (0, 1] -> parameters


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _two(rng: Rng) -> tuple[float, float]:
    """Two numbers of either sign, neither of them negligible beside the other, the greater of size 1."""
    smaller = rng.uniform(0.35, 1.0)
    pair = (_sign(rng), _sign(rng) * smaller)
    return pair if rng.random() < 0.5 else pair[::-1]


def _defocus(rng: Rng, geometry: Geometry) -> Family:
    return lambda x: {"radius": 0.5 + 5.5 * x}  # a disk within a pixel is no blur


def _motion(rng: Rng, geometry: Geometry) -> Family:
    angle = float(rng.uniform(0, 180))
    return lambda x: {"length": 20 * x, "angle": angle}


def _jpeg(rng: Rng, geometry: Geometry) -> Family:
    return lambda x: {"quality": float(round(96 - 88 * x))}


def _lens(rng: Rng, geometry: Geometry) -> Family:
    k1 = 0.35 * float(rng.choice([-1.0, -1.0, 1.0]))  # barrels are more common
    share = float(rng.uniform(-0.35, -0.1))
    return lambda x: {"k1": k1 * x, "k2": share * k1 * x}


def _read(rng: Rng, geometry: Geometry) -> Family:
    return lambda x: {"sigma": 0.08 * x}


def _shot(rng: Rng, geometry: Geometry) -> Family:
    return lambda x: {"full_well": 40 / x**2}


def _vignetting(rng: Rng, geometry: Geometry) -> Family:
    return lambda x: {"strength": 0.95 * x}


def _exposure(rng: Rng, geometry: Geometry) -> Family:
    stops = 2.0 * _sign(rng)
    return lambda x: {"stops": stops * x}


def _white_balance(rng: Rng, geometry: Geometry) -> Family:
    red, blue = _two(rng)
    return lambda x: {"red": math.exp(0.5 * red * x), "blue": math.exp(0.5 * blue * x)}


def _gamma(rng: Rng, geometry: Geometry) -> Family:
    power = 0.8 * _sign(rng)
    return lambda x: {"gamma": math.exp(power * x)}


def _aberration(rng: Rng, geometry: Geometry) -> Family:
    red, blue = _two(rng)
    return lambda x: {"red": 0.04 * red * x, "blue": 0.04 * blue * x}


def _uneven(rng: Rng, geometry: Geometry) -> Family:
    angle = float(rng.uniform(-180, 180))
    return lambda x: {"strength": 0.75 * x, "angle": angle}


def _shadow(rng: Rng, geometry: Geometry) -> Family:
    fixed = {
        "offset": float(rng.uniform(-0.3, 0.3)) * geometry.width,
        "angle": float(rng.uniform(-180, 180)),
        "softness": float(np.exp(rng.uniform(math.log(1.5), math.log(16)))),
    }
    return lambda x: {"strength": 0.9 * x, **fixed}


def _resolution(rng: Rng, geometry: Geometry) -> Family:
    """The factor of a whole number of columns: those between two of them are one and the same camera."""
    return lambda x: {"factor": geometry.width / round(geometry.width / (1 + 3.5 * x))}


def _pose(rng: Rng, geometry: Geometry) -> Family:
    yaw, pitch = _two(rng)
    roll = _sign(rng) * rng.uniform(0.35, 1.0)
    return lambda x: {"yaw": 0.07 * yaw * x, "pitch": 0.07 * pitch * x, "roll": 0.12 * roll * x}


FAMILIES: dict[str, Callable[[Rng, Geometry], Family]] = {
    "camera_pose_offset": _pose,
    "uneven_illumination": _uneven,
    "cast_shadow": _shadow,
    "lens_distortion": _lens,
    "chromatic_aberration": _aberration,
    "vignetting": _vignetting,
    "defocus_blur": _defocus,
    "motion_blur": _motion,
    "low_resolution": _resolution,
    "exposure": _exposure,
    "shot_noise": _shot,
    "read_noise": _read,
    "white_balance": _white_balance,
    "gamma": _gamma,
    "jpeg_compression": _jpeg,
}
IN_STEPS = ("jpeg_compression", "low_resolution")  # cannot be as weak as one likes
OF_COLOUR = ("chromatic_aberration", "white_balance")
