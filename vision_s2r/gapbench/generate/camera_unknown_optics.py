"""What lenses do that the library of effects does not hold: kinds of unknown, see `camera_unknown`."""

import math
from collections.abc import Callable

import cv2
import numpy as np

from vision_s2r.gapbench.generate.camera_effects import Array, Geometry, Stage, to_coded, to_linear, warp

Rng = np.random.Generator


def blurred(pictures: Array, sigma: float) -> Array:
    return np.stack([cv2.GaussianBlur(p, (0, 0), sigma, borderType=cv2.BORDER_REPLICATE) for p in pictures])


def ghost_reflection(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A faint, soft image of the scene, upside down, between the lens' surfaces."""
    tint, softness = rng.uniform(0.6, 1.0, 3), rng.uniform(1.0, 4.0)

    def step(canvas: Array, geometry: Geometry) -> Array:
        light = to_linear(canvas)
        ghost = blurred(np.ascontiguousarray(light[:, ::-1, ::-1]), softness * geometry.scale)
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
        glow = blurred(np.ascontiguousarray(np.maximum(light - knee, 0)), radius * geometry.scale)
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


def lens_breathing(strength: float, rng: Rng) -> tuple[str, Stage]:
    """The lens focuses anew before each frame, and its picture grows or shrinks with it."""
    seed = rng.integers(2**32)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        sizes = 1 + 0.06 * strength * np.random.default_rng(seed).uniform(-1, 1, len(canvas))
        grown = [
            warp(
                frame[None], geometry.cx + (x - geometry.cx) * s, geometry.cy + (y - geometry.cy) * s, geometry, "cubic"
            )
            for frame, s in zip(canvas, sizes, strict=True)
        ]
        return np.concatenate(grown)

    return "optics", step


def field_curvature(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Sharp at the centre, ever less so towards the corners: the focal surface is no plane."""
    sigma = 6 * strength

    def step(canvas: Array, geometry: Geometry) -> Array:
        away = np.hypot(geometry.along(0), geometry.along(90)) / np.hypot(geometry.width, geometry.height) * 2
        share = np.clip(away, 0, 1)[..., None] ** 2
        return canvas * (1 - share) + share * blurred(canvas, sigma * geometry.scale)

    return "optics", step


def tilted_sensor(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Sharp along a line off the centre, ever less so to either side: the sensor is not parallel to the focal plane."""
    angle, offset, sigma = rng.uniform(0, 360), rng.uniform(0.3, 0.8), 6 * strength

    def step(canvas: Array, geometry: Geometry) -> Array:
        away = np.abs(geometry.along(angle) / (geometry.width / 2) - offset) / (1 + offset)
        share = np.clip(away, 0, 1)[..., None]
        return canvas * (1 - share) + share * blurred(canvas, sigma * geometry.scale)

    return "optics", step


def axial_colour(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Red and blue are in focus at other distances than green: each has a soft rim of its own around what is bright."""
    red, blue = 3 * strength * rng.uniform(0.3, 1.0), 3 * strength

    def step(canvas: Array, geometry: Geometry) -> Array:
        seen = canvas.copy()
        for channel, sigma in ((0, red), (2, blue)):
            seen[..., channel] = blurred(canvas[..., channel], sigma * geometry.scale)
        return seen

    return "optics", step


def mechanical_vignetting(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A hood or barrel a little off the axis cuts the corners off, with a soft rim."""
    centre, reach = rng.uniform(-0.15, 0.15, 2), 1.45 - 0.75 * strength

    def step(canvas: Array, geometry: Geometry) -> Array:
        half = geometry.width / 2
        away = np.hypot(geometry.along(0) / half - centre[0], geometry.along(90) / half - centre[1])
        passed = 1 / (1 + np.exp(np.clip((away - reach) / 0.05, -50, 50)))
        return to_coded(to_linear(canvas) * passed[..., None])

    return "optics", step


def _off_axis(geometry: Geometry) -> tuple[Array, Array, Array]:
    """How far pixels are from the axis, each [H, W]: along x and y, px, and of half the picture's width, at most 1."""
    x, y = geometry.pixels()
    x, y = np.broadcast_arrays(x - geometry.cx, y - geometry.cy)
    return x, y, np.clip(np.hypot(x, y) / geometry.width * 2, 0, 1)


def coma(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Points away from the axis have tails that point outwards, the longer the farther they are.

    About their centres of light: a point that is moved besides is a lens' distortion.
    """
    reach, count = 0.22 * strength, 9
    parts, places = np.arange(count, 0, -1) / (count * (count + 1) / 2), np.linspace(0, 1, count)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y, away = _off_axis(geometry)
        smeared = np.zeros_like(canvas)
        for part, place in zip(parts, places - parts @ places, strict=True):
            size = 1 - reach * away * place
            smeared += part * warp(canvas, geometry.cx + x * size, geometry.cy + y * size, geometry, "linear")
        return smeared

    return "optics", step


def lens_flare(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A lamp beside the picture: discs of stray light on a line through its centre, the same in each frame."""
    turn, discs = rng.uniform(-180, 180), rng.uniform(-0.8, 0.8, 5)
    sizes, tints = rng.uniform(0.08, 0.3, 5), rng.uniform(0.3, 1.0, (5, 3))

    def step(canvas: Array, geometry: Geometry) -> Array:
        along, across = geometry.along(turn) / geometry.width, geometry.along(turn + 90) / geometry.width
        stray = np.zeros((*geometry.shape, 3))
        for place, size, tint in zip(discs, sizes, tints, strict=True):
            away = np.hypot(along - place, across) / size
            stray += tint / (1 + np.exp(np.clip((away - 1) * 12, -50, 50)))[..., None]
        return to_coded(to_linear(canvas) + 0.3 * strength * stray)

    return "optics", step


def heat_haze(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Warm air before the lens: a smooth displacement, other in each frame."""
    seed = rng.integers(2**32)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        fields = np.random.default_rng(seed).normal(size=(len(canvas), 2, 8, 8)) * 4 * strength
        moved = []
        for frame, field in zip(canvas, fields, strict=True):
            u, v = (cv2.resize(f, geometry.shape[::-1], interpolation=cv2.INTER_CUBIC) for f in field)
            moved.append(warp(frame[None], x + u, y + v, geometry, "cubic"))
        return np.concatenate(moved)

    return "optics", step


def spherical_aberration(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Rays through the lens' rim meet before the others do: a sharp core in a soft halo, alike all over the picture."""
    share, reach = 0.85 * strength, rng.uniform(2, 5)

    def step(canvas: Array, geometry: Geometry) -> Array:
        light = to_linear(canvas)
        halo = sum(blurred(light, reach * size * geometry.scale) for size in (0.4, 1.0, 1.6)) / 3
        return to_coded((1 - share) * light + share * halo)

    return "optics", step


def astigmatism(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Points away from the axis are lines around it, the longer the farther they are: of two focal surfaces one."""
    reach, count = 0.12 * strength, 9

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y, away = _off_axis(geometry)
        smeared = np.zeros_like(canvas)
        for k in range(count):
            turn = reach * away * (2 * k / (count - 1) - 1)
            u, v = _turned(x, y, turn)
            smeared += warp(canvas, geometry.cx + u, geometry.cy + v, geometry, "linear")
        return smeared / count

    return "optics", step


def greasy_cover(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A thumb's print on the cover glass: it scatters what is seen through it, in a part of the picture."""
    centre, size, radius = rng.uniform(0.25, 0.75, 2), rng.uniform(0.25, 0.5), rng.uniform(6, 14)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        squared = (x / geometry.width - centre[0]) ** 2 + (y / geometry.height - centre[1]) ** 2
        share = 0.9 * strength * np.exp(-squared / (2 * size**2))[..., None]
        light = to_linear(canvas)
        return to_coded((1 - share) * light + share * blurred(light, radius * geometry.scale))

    return "optics", step


def approaching_camera(strength: float, rng: Rng) -> tuple[str, Stage]:
    """The camera comes nearer while the shutter is open: lines away from where it goes."""
    place, reach = rng.uniform(-0.3, 0.3, 2), 0.16 * strength
    return "optics", _moving(place, lambda x, y, part: (x * (1 + reach * part), y * (1 + reach * part)))


def turning_camera(strength: float, rng: Rng) -> tuple[str, Stage]:
    """The camera turns about a point of the picture while the shutter is open, as a wrist does."""
    place, reach = rng.uniform(-0.5, 0.5, 2), 0.16 * strength

    return "optics", _moving(place, lambda x, y, part: _turned(x, y, reach * part))


def _turned(x: Array, y: Array, turn: Array | float) -> tuple[Array, Array]:
    """Places turned about the origin by an angle, rad."""
    return x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)


def _moving(place: Array, to: Callable[[Array, Array, float], tuple[Array, Array]]) -> Stage:
    """The mean light of where pixels are looked up, x and y from this `place` of the picture, at parts -0.5 to 0.5."""

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = geometry.pixels()
        cx, cy = geometry.cx + place[0] * geometry.width, geometry.cy + place[1] * geometry.height
        x, y = np.broadcast_arrays(x - cx, y - cy)
        light, parts = to_linear(canvas), np.linspace(-0.5, 0.5, 13)
        summed = np.zeros_like(canvas)
        for u, v in (to(x, y, float(part)) for part in parts):
            summed += warp(light, cx + u, cy + v, geometry, "cubic")
        return to_coded(np.maximum(summed / len(parts), 0))

    return step


def drops(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Drops of water on the cover: each shows its surroundings small, upside down and soft."""
    places, sizes, soft = rng.uniform(0.05, 0.95, (9, 2)), rng.uniform(5, 14, 9), rng.uniform(1, 3)

    def step(canvas: Array, geometry: Geometry) -> Array:
        x, y = np.broadcast_arrays(*geometry.pixels())
        seen, hazy = canvas, blurred(canvas, soft * geometry.scale)
        for (u, v), size in zip(places, sizes * min(1.0, 0.3 + strength), strict=True):
            dx, dy = x - u * geometry.width, y - v * geometry.height
            inside = 1 / (1 + np.exp(np.clip((np.hypot(dx, dy) / size - 1) * 12, -50, 50)))
            turned = warp(hazy, x - 3 * dx, y - 3 * dy, geometry, "linear")
            share = min(1.0, 2 * strength) * inside[..., None]
            seen = seen * (1 - share) + share * turned
        return seen

    return "optics", step
