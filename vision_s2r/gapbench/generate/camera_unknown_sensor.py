"""What sensors do that the library of effects does not hold: kinds of unknown, see `camera_unknown`."""

import cv2
import numpy as np

from vision_s2r.gapbench.generate.camera_effects import Array, Geometry, Stage, to_coded, to_linear
from vision_s2r.gapbench.generate.camera_unknown_optics import blurred

Rng = np.random.Generator


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


def black_level(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A pedestal under all values that nobody takes off."""
    level = 0.15 * strength * rng.uniform(0.5, 1.0, 3)
    return "sensor", lambda pictures, geometry: level + (1 - level) * pictures


def line_jitter(strength: float, rng: Rng) -> tuple[str, Stage]:
    """An analogue line starts now early, now late: each row of each frame is displaced sideways."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        shifts = np.random.default_rng(seed).normal(size=pictures.shape[:2]) * 3 * strength
        columns = np.arange(pictures.shape[2]) - shifts[..., None]
        low = np.clip(np.floor(columns).astype(int), 0, pictures.shape[2] - 2)
        part = np.clip(columns - low, 0, 1)[..., None]
        at, after = (np.take_along_axis(pictures, index[..., None], axis=2) for index in (low, low + 1))
        return at * (1 - part) + after * part

    return "sensor", step


def column_gains(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Each column has an amplifier of its own, whose gain is always the same."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        gain = 1 + 0.4 * strength * np.random.default_rng(seed).normal(size=(1, 1, pictures.shape[2], 1))
        return to_coded(to_linear(pictures) * np.maximum(gain, 0))

    return "sensor", step


def dark_current(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Warm pixels: each adds light of its own, most little, some much, the same in each frame."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        drawn = np.random.default_rng(seed).exponential(size=pictures.shape[1:])
        return to_coded(to_linear(pictures) + 0.1 * strength * drawn**2)

    return "sensor", step


def ccd_smear(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Charge is carried past bright places: columns glow by as much as there is in them."""

    def step(pictures: Array, geometry: Geometry) -> Array:
        light = to_linear(pictures)
        bright = np.maximum(light - np.quantile(light, 0.8), 0).mean(axis=1, keepdims=True)
        return to_coded(light + 1.5 * strength * bright)

    return "sensor", step


def mains_banding(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Lamps on the mains under a rolling shutter: dark bands across, elsewhere in each frame."""
    seed, period = rng.integers(2**32), rng.uniform(25, 80)

    def step(pictures: Array, geometry: Geometry) -> Array:
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(pictures), 1))
        wave = np.cos(2 * np.pi * np.arange(pictures.shape[1]) / period + phase)
        return to_coded(to_linear(pictures) * (1 - 0.6 * strength * wave**2)[:, :, None, None])

    return "sensor", step


def sensor_dust(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Specks on the sensor's glass: small dark discs with sharp rims at fixed places."""
    places, sizes = rng.uniform(0, 1, (60, 2)), rng.uniform(1.0, 3.0, 60)

    def step(pictures: Array, geometry: Geometry) -> Array:
        y, x = np.mgrid[: pictures.shape[1], : pictures.shape[2]]
        passed = np.ones(pictures.shape[1:3])
        for (u, v), size in zip(places, sizes, strict=True):
            away = np.hypot(x - u * pictures.shape[2], y - v * pictures.shape[1])
            passed *= 1 - 0.9 * strength * np.clip(size + 0.5 - away, 0, 1)
        return to_coded(to_linear(pictures) * passed[..., None])

    return "sensor", step


def lamp_drift(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A lamp that warms up, or a battery that runs down: frame by frame there is more light, or less."""
    stops = 2.5 * strength * rng.choice([-1, 1])

    def step(pictures: Array, geometry: Geometry) -> Array:
        gain = 2 ** (stops * np.linspace(-0.5, 0.5, len(pictures)))
        return to_coded(to_linear(pictures) * gain[:, None, None, None])

    return "sensor", step


def uneven_shutter(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Curtains of a focal plane's shutter run at unequal speed, another in each frame: rows are exposed ever longer."""
    seed = rng.integers(2**32)

    def step(pictures: Array, geometry: Geometry) -> Array:
        speeds = np.random.default_rng(seed).uniform(-1, 1, (len(pictures), 1))
        gain = 2 ** (2.5 * strength * speeds * np.linspace(-0.5, 0.5, pictures.shape[1]))
        return to_coded(to_linear(pictures) * gain[:, :, None, None])

    return "sensor", step


def still_bands(strength: float, rng: Rng) -> tuple[str, Stage]:
    """LEDs that are switched in step with the frames, under a rolling shutter: dark bands that stand still."""
    period, share, phase = rng.uniform(20, 60), rng.uniform(0.3, 0.7), rng.uniform(0, 1)

    def step(pictures: Array, geometry: Geometry) -> Array:
        place = (np.arange(pictures.shape[1]) / period + phase) % 1
        off = 1 / (1 + np.exp(np.clip((np.abs(place - 0.5) - share / 2) * 40, -50, 50)))
        return to_coded(to_linear(pictures) * (1 - 0.8 * strength * off)[:, None, None])

    return "sensor", step


def blooming(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Full wells spill over along their columns: a streak on either side of what is bright, fading with distance."""
    reach = rng.uniform(4, 15)

    def step(pictures: Array, geometry: Geometry) -> Array:
        light = to_linear(pictures)
        spilt = np.maximum(light - np.quantile(light, 0.85), 0)
        rows = np.arange(pictures.shape[1])
        kept = np.exp(-np.abs(rows[:, None] - rows) / reach) * (rows[:, None] != rows)
        return to_coded(light + strength * np.einsum("ij,njwc->niwc", kept, spilt))

    return "sensor", step


def charge_diffusion(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Charge wanders to neighbouring pixels before it is caught, the more the deeper its light goes: red above all."""
    widest = 3 * strength
    sigmas = widest * np.array([1.0, rng.uniform(0.3, 0.7), rng.uniform(0.0, 0.2)])

    def step(pictures: Array, geometry: Geometry) -> Array:
        light = to_linear(pictures)
        for channel, sigma in enumerate(sigmas):
            if sigma > 0.1:
                light[..., channel] = blurred(np.ascontiguousarray(light[..., channel]), sigma)
        return to_coded(light)

    return "sensor", step


def image_lag(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Wells are not emptied: part of the charge of each frame, and of those before, is read with the next."""

    def step(pictures: Array, geometry: Geometry) -> Array:
        light = to_linear(pictures)
        for frame in range(1, len(light)):
            light[frame] += 0.5 * strength * (light[frame - 1] - light[frame])
        return to_coded(light)

    return "sensor", step
