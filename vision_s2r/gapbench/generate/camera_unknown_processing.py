"""What a camera's software does that the library of effects does not hold: kinds of unknown, see `camera_unknown`."""

import cv2
import numpy as np

from vision_s2r.gapbench.generate.camera_effects import Array, Geometry, Stage, brightness, to_coded, to_linear
from vision_s2r.gapbench.generate.camera_unknown_optics import blurred

Rng = np.random.Generator


def posterization(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Too few levels of each channel."""
    levels = round(3 + 61 * (1 - strength) ** 2)
    return "processing", lambda pictures, geometry: np.round(pictures * levels) / levels


def sharpening_halo(strength: float, rng: Rng) -> tuple[str, Stage]:
    """An unsharp mask, as small cameras come with."""
    sigma = rng.uniform(0.8, 2.0)
    return "processing", lambda pictures, geometry: pictures + 3 * strength * (pictures - blurred(pictures, sigma))


def tone_curve(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A tone curve shaped like an S: more contrast between, less at the ends, or the other way."""
    bend = strength * float(rng.choice([0.95, 0.95, -0.95])) / (2 * np.pi)
    return "processing", lambda pictures, geometry: pictures - bend * np.sin(2 * np.pi * pictures)


def hue_clipping(strength: float, rng: Rng) -> tuple[str, Stage]:
    """A small gamut: colours near one hue lose their purity."""
    hue = rng.uniform(0, 2 * np.pi)

    def step(pictures: Array, geometry: Geometry) -> Array:
        grey = brightness(pictures)
        red, blue = pictures[..., 0] - grey, pictures[..., 2] - grey
        near = np.maximum(np.cos(np.arctan2(red, blue) - hue), 0) ** 2
        return grey[..., None] + (1 - strength * near)[..., None] * (pictures - grey[..., None])

    return "processing", step


def denoising(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Noise reduction by medians, which leaves edges and takes textures."""

    def step(pictures: Array, geometry: Geometry) -> Array:
        whole = np.round(pictures * 255).astype(np.uint8)
        taken = np.stack([cv2.medianBlur(np.ascontiguousarray(p), 5).reshape(p.shape) for p in whole]) / 255.0
        return pictures + strength * (taken - pictures)

    return "processing", step


def auto_exposure(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Each frame is made as bright as all others, dark scenes lighter and bright ones darker."""

    def step(pictures: Array, geometry: Geometry) -> Array:
        light = to_linear(pictures)
        level = light.mean(axis=(1, 2, 3), keepdims=True)
        return to_coded(light * (np.exp(np.log(level).mean()) / level) ** strength)

    return "processing", step


def local_tone_mapping(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Dark surroundings are lifted and bright ones lowered, as pictures of a high dynamic range are shown."""
    radius = rng.uniform(8, 16)
    return "processing", lambda pictures, geometry: pictures - strength * (blurred(pictures, radius) - 0.5)


def auto_white_balance(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Each frame's mean is made grey, whatever colour its scene has."""

    def step(pictures: Array, geometry: Geometry) -> Array:
        means = pictures.mean(axis=(1, 2), keepdims=True)
        return pictures * (means.mean(axis=-1, keepdims=True) / means) ** strength

    return "processing", step


def chroma_subsampling(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Colour is sent at a quarter of the resolution, as cheap video links do."""
    share = min(1.0, 2 * strength)

    def step(pictures: Array, geometry: Geometry) -> Array:
        grey = brightness(pictures)[..., None]
        height, width = pictures.shape[1:3]
        coarse = [cv2.resize(p, (width // 8, height // 8), interpolation=cv2.INTER_AREA) for p in pictures - grey]
        colour = np.stack([cv2.resize(p, (width, height), interpolation=cv2.INTER_NEAREST) for p in coarse])
        return grey + (1 - share) * (pictures - grey) + share * colour

    return "processing", step


def temporal_denoising(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Each frame is mixed with the one before it, which stays as a ghost."""
    return "processing", lambda pictures, geometry: pictures + 0.4 * strength * (np.roll(pictures, 1, 0) - pictures)


def colour_smear(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Colour is sent along each line with a fraction of the brightness' bandwidth, as composite video does."""
    reach = 8 * strength

    def step(pictures: Array, geometry: Geometry) -> Array:
        grey = brightness(pictures)[..., None]
        smeared = [
            cv2.GaussianBlur(p, (0, 0), sigmaX=reach, sigmaY=0.01, borderType=cv2.BORDER_REPLICATE)
            for p in pictures - grey
        ]
        return grey + np.stack(smeared)

    return "processing", step


def lost_blocks(strength: float, rng: Rng) -> tuple[str, Stage]:
    """Packets of a video link get lost: their blocks still show the frame before, others in each frame."""
    seed, side = rng.integers(2**32), 16

    def step(pictures: Array, geometry: Geometry) -> Array:
        rows, columns = (-(-size // side) for size in pictures.shape[1:3])
        lost = np.random.default_rng(seed).random((len(pictures), rows, columns)) < 0.5 * strength
        lost = lost.repeat(side, 1).repeat(side, 2)[:, : pictures.shape[1], : pictures.shape[2], None]
        return np.where(lost, np.roll(pictures, 1, 0), pictures)

    return "processing", step
