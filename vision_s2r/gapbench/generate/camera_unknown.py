"""What cameras do that the library of effects does not hold: the unknown of generated recordings.

Each kind is a function (strength in (0, 1], generator) -> (stage, step): where in the camera it happens, and what it
does there, the same at every call. Kinds for tuning and for reporting are disjoint.
"""

import math
from collections.abc import Callable

import cv2
import numpy as np

from vision_s2r.gapbench.generate.camera_effects import Array, Geometry, Stage, to_coded, to_linear, warp

Rng = np.random.Generator
Kind = Callable[[float, Rng], tuple[str, Stage]]


def _blur(pictures: Array, sigma: float) -> Array:
    return np.stack([cv2.GaussianBlur(p, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE) for p in pictures])


# -- optics ----------------------------------------------------------------------------------------------------------


def ghost_reflection(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A faint, soft image of the scene, upside down, between the lens' surfaces."""
    tint, softness = rng.uniform(0.6, 1.0, 3), rng.uniform(1.0, 4.0)

    def step(canvas: Array, geometry: Geometry) -> Array:
        light = to_linear(canvas)
        ghost = _blur(np.ascontiguousarray(light[:, ::-1, ::-1]), softness * geometry.scale)
        return to_coded(light + 0.6 * strength * tint * ghost)

    return "optics", step


def veiling_glare(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Light scattered all over the picture, as much as there is in it, and more towards one side."""
    share, angle = 0.5 * strength, rng.uniform(-180, 180)

    def step(canvas: Array, geometry: Geometry) -> Array:
        light = to_linear(canvas)
        veil = light.mean(axis=(1, 2), keepdims=True)
        side = 1 + 0.5 * geometry.along(angle)[..., None] / geometry.width
        return to_coded((1 - share) * light + share * veil * side)

    return "optics", step


def bloom(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Bright places glow into what surrounds them."""
    radius = rng.uniform(4, 9)

    def step(canvas: Array, geometry: Geometry) -> Array:
        light = to_linear(canvas)
        knee = np.quantile(light, 0.8)
        glow = _blur(np.ascontiguousarray(np.maximum(light - knee, 0)), radius * geometry.scale)
        return to_coded(light + 4 * strength * glow)

    return "optics", step


def tangential_distortion(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A lens not parallel to its sensor: the p1, p2 of OpenCV's model."""
    turn = rng.uniform(0, 2 * math.pi)
    p1, p2 = 0.12 * strength * math.cos(turn), 0.12 * strength * math.sin(turn)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        x, y = np.broadcast_arrays((x - geometry.cx) / geometry.fx, (y - geometry.cy) / geometry.fy)
        squared = x**2 + y**2
        u = x - (2 * p1 * x * y + p2 * (squared + 2 * x**2))  # the inverse to first order, a distortion as good
        v = y - (p1 * (squared + 2 * y**2) + 2 * p2 * x * y)
        return warp(canvas, u * geometry.fx + geometry.cx, v * geometry.fy + geometry.cy, geometry, "cubic")

    return "optics", step


def rolling_shutter_skew(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Rows are read one after the other while the camera moves sideways."""
    slope = 0.15 * strength * rng.choice([-1, 1])

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        return warp(canvas, x + slope * (y - geometry.cy), y + 0 * x, geometry, "cubic")

    return "optics", step


def aspect_ratio(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Pixels are not square."""
    stretch = 1 + 0.12 * strength * rng.choice([-1, 1])

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        return warp(canvas, geometry.cx + (x - geometry.cx) * stretch + 0 * y, y + 0 * x, geometry, "cubic")

    return "optics", step


def local_warping(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A wavy cover glass: a smooth displacement, other at each place, the same in each frame."""
    fields = rng.normal(size=(2, 6, 6))

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        u, v = (cv2.resize(f, geometry.shape[::-1], interpolation=cv2.INTER_CUBIC) * 4 * strength for f in fields)
        return warp(canvas, x + u, y + v, geometry, "cubic")

    return "optics", step


def frame_jitter(strength: float, rng: Rng) -> tuple[str, Stage]:
    """The camera vibrates: each frame is displaced by another small vector."""
    seed = rng.integers(2**32)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        shifts = np.random.default_rng(seed).normal(size=(len(canvas), 2)) * 3 * strength
        moved = [
            warp(frame[None], x + u + 0 * y, y + v + 0 * x, geometry, "cubic")[0]
            for frame, (u, v) in zip(canvas, shifts, strict=True)
        ]
        return np.stack(moved)

    return "optics", step


def lens_dirt(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Dust on the front lens: soft dark spots at fixed places."""
    places, sizes = rng.uniform(0.05, 0.95, (7, 2)), rng.uniform(3, 11, 7)
    depth = np.minimum(rng.uniform(0.3, 1.0, 7) * 1.3 * strength, 0.95)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        passed = np.ones(geometry.shape)
        for (u, v), size, dark in zip(places, sizes, depth, strict=True):
            squared = ((x - u * geometry.width) ** 2 + (y - v * geometry.height) ** 2) / size**2
            passed *= 1 - dark * np.exp(-(squared**2))
        return to_coded(to_linear(canvas) * passed[..., None])

    return "optics", step


# -- sensor ----------------------------------------------------------------------------------------------------------


def row_banding(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Each row of each frame is read with an offset of its own."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        rows = np.random.default_rng(seed).normal(size=(*pictures.shape[:2], 1, 1))
        return pictures + 0.1 * strength * rows

    return "sensor", step


def fixed_pattern_noise(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Each pixel has a gain of its own, the same in each frame."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        gain = 1 + 0.4 * strength * np.random.default_rng(seed).normal(size=pictures.shape[1:])
        return to_coded(to_linear(pictures) * np.maximum(gain, 0))

    return "sensor", step


def salt_and_pepper(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Pixels lost on the way, black or white, others in each frame."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        drawn = np.random.default_rng(seed).random((*pictures.shape[:3], 1))
        share = 0.03 * strength
        return np.where(drawn < share, 0.0, np.where(drawn > 1 - share, 1.0, pictures))

    return "sensor", step


def dead_pixels(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Sites of the sensor that are always dark or always full, channel by channel."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        drawn = np.random.default_rng(seed).random(pictures.shape[1:])
        share = 0.03 * strength
        return np.where(drawn < share, 0.0, np.where(drawn > 1 - share, 1.0, pictures))

    return "sensor", step


def colour_crosstalk(strength: float, rng: Rng) -> tuple[str, Stage]:
    """The colour filters overlap: channels mix in linear light."""
    leak = rng.uniform(0.1, 1.0, (3, 3))
    np.fill_diagonal(leak, 0)
    mix = np.eye(3) * (1 - 0.6 * strength) + 0.6 * strength * leak / leak.sum(1, keepdims=True)

    def step(pictures: Array, geometry: Geometry) -> Array:
        return to_coded(to_linear(pictures) @ mix.T)

    return "sensor", step


def interlacing(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Every other row was taken later, and is displaced sideways."""
    shift = 4 * strength * rng.choice([-1, 1])

    def step(pictures: Array, geometry: Geometry) -> Array:
        columns = np.arange(pictures.shape[2]) - shift
        low = np.clip(np.floor(columns).astype(int), 0, pictures.shape[2] - 2)
        part = np.clip(columns - low, 0, 1)[None, None, :, None]
        result = pictures.copy()
        odd = pictures[:, 1::2]
        result[:, 1::2] = odd[:, :, low] * (1 - part) + odd[:, :, low + 1] * part
        return result

    return "sensor", step


def bayer_demosaicing(strength: float, rng: Rng) -> tuple[str, Stage]:
    """One colour a pixel, the others interpolated bilinearly; `strength` mixes it with a filterless sensor."""
    weight = np.array([[1, 2, 1], [2, 4, 2], [1, 2, 1]]) / 4.0

    def step(pictures: Array, geometry: Geometry) -> Array:
        sites = np.zeros((*pictures.shape[1:3], 3))
        sites[::2, ::2, 0] = sites[::2, 1::2, 1] = sites[1::2, ::2, 1] = sites[1::2, 1::2, 2] = 1
        counted = cv2.filter2D(sites, cv2.CV_64F, weight, borderType=cv2.BORDER_REFLECT_101)
        summed = [cv2.filter2D(p * sites, cv2.CV_64F, weight, borderType=cv2.BORDER_REFLECT_101) for p in pictures]
        return pictures * (1 - strength) + strength * np.stack(summed) / counted

    return "sensor", step


def temporal_flicker(strength: float, rng: Rng) -> tuple[str, Stage]:
    """The lamp flickers: each frame has an exposure of its own, around the right one."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        stops = np.random.default_rng(seed).normal(size=len(pictures))
        gain = 2 ** (1.2 * strength * (stops - stops.mean()))
        return to_coded(to_linear(pictures) * gain[:, None, None, None])

    return "sensor", step


def moire(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Mains hum or a screen's raster: a wave over the picture, at another phase in each frame."""
    seed, (u, v) = rng.integers(2**32), rng.uniform(0.05, 0.22, 2)

    def step(pictures: Array, geometry: Geometry) -> Array:
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(pictures), 1, 1))
        y, x = np.mgrid[: pictures.shape[1], : pictures.shape[2]]
        return pictures * (1 + 0.4 * strength * np.sin(2 * np.pi * (u * x + v * y) + phase))[..., None]

    return "sensor", step


# -- processing ------------------------------------------------------------------------------------------------------


def posterization(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Too few levels of each channel."""
    levels = round(3 + 61 * (1 - strength) ** 2)
    return "processing", lambda pictures, geometry: np.round(pictures * levels) / levels


def sharpening_halo(strength: float, rng: Rng) -> tuple[str, Stage]:
    """An unsharp mask, as small cameras come with."""
    sigma = rng.uniform(0.8, 2.0)
    return "processing", lambda pictures, geometry: pictures + 3 * strength * (pictures - _blur(pictures, sigma))


def tone_curve(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A tone curve shaped like an S: more contrast between, less at the ends, or the other way."""
    bend = strength * float(rng.choice([0.95, 0.95, -0.95])) / (2 * np.pi)
    return "processing", lambda pictures, geometry: pictures - bend * np.sin(2 * np.pi * pictures)


def hue_clipping(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A small gamut: colours near one hue lose their purity."""
    hue = rng.uniform(0, 2 * np.pi)

    def step(pictures: Array, geometry: Geometry) -> Array:
        grey = pictures @ np.array([0.299, 0.587, 0.114])
        red, blue = pictures[..., 0] - grey, pictures[..., 2] - grey
        near = np.maximum(np.cos(np.arctan2(red, blue) - hue), 0) ** 2
        return grey[..., None] + (1 - strength * near)[..., None] * (pictures - grey[..., None])

    return "processing", step


UNKNOWN: dict[str, tuple[Kind, ...]] = {
    "tuning": (
        row_banding,
        ghost_reflection,
        posterization,
        bloom,
        colour_crosstalk,
        salt_and_pepper,
        tangential_distortion,
        sharpening_halo,
        tone_curve,
        lens_dirt,
        aspect_ratio,
    ),
    "reporting": (
        fixed_pattern_noise,
        dead_pixels,
        veiling_glare,
        rolling_shutter_skew,
        interlacing,
        hue_clipping,
        local_warping,
        bayer_demosaicing,
        temporal_flicker,
        moire,
        frame_jitter,
    ),
}
