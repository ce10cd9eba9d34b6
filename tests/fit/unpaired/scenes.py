"""Pictures of one place, none of the same scene: a textured ground and things scattered on it."""

import cv2
import numpy as np
import torch

from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.recording import CameraRecording

SIZE = 72


def scenes(count: int, seed: int, place: int = 0) -> np.ndarray:
    """float32 [count, SIZE, SIZE, 3] in [0, 1], of 8 bits."""
    ground = _texture(np.random.default_rng(place))
    rng = np.random.default_rng([place, seed])
    pictures = [_scene(ground, rng) for _ in range(count)]
    return (np.stack(pictures).clip(0, 1) * 255).round().astype(np.float32) / np.float32(255)


def recording(effects: dict[str, dict[str, float]], seed: int, count: int = 16) -> CameraRecording:
    """Two sets, the real one through a camera with these effects and 0.5 grey levels of noise that any camera has."""
    sim, real = scenes(count, 2 * seed), scenes(count, 2 * seed + 1)
    before = {name: values for name, values in effects.items() if name != "jpeg_compression"}
    encoder = {name: values for name, values in effects.items() if name == "jpeg_compression"}
    seeds = torch.arange(count) + 1000 * (seed + 1)
    taken = torch.from_numpy(real).permute(0, 3, 1, 2)
    taken = Camera()(taken, CameraParameters.of(before, count, seeds))
    taken = taken + torch.randn(taken.shape, generator=torch.Generator().manual_seed(seed)) * (0.5 / 255)
    taken = Camera()((taken.clamp(0, 1) * 255).round() / 255, CameraParameters.of(encoder, count, seeds))
    return of(sim, taken.permute(0, 2, 3, 1).numpy())


def of(sim: np.ndarray, real: np.ndarray, grey: bool = False) -> CameraRecording:
    """A recording of two sets, rounded to 8 bits."""
    real = (real.clip(0, 1) * 255).round().astype(np.float32) / np.float32(255)
    names = tuple(f"{k:04d}" for k in range(len(sim)))
    return CameraRecording("unpaired", "srgb", sim, real, None, None, None, 8, grey, names, names[: len(real)])


def _texture(rng: np.random.Generator) -> np.ndarray:
    size = 4 * SIZE
    rough = sum(
        cv2.resize(rng.standard_normal((size // step, size // step)).astype(np.float32), (size, size)) * step**0.5
        for step in (2, 4, 8, 16)
    )
    return 0.45 + 0.03 * rough[..., None] * rng.uniform(0.7, 1.3, 3) + rng.uniform(-0.1, 0.1, 3)


def _scene(ground: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    low = rng.integers(0, len(ground) - 2 * SIZE, 2)
    picture = np.ascontiguousarray(ground[low[0] : low[0] + 2 * SIZE, low[1] : low[1] + 2 * SIZE])
    for _ in range(int(rng.integers(10, 20))):
        at = tuple(int(x) for x in rng.integers(0, 2 * SIZE, 2))
        colour = rng.uniform(0.08, 0.92, 3).tolist()
        if rng.random() < 0.5:
            cv2.circle(picture, at, int(rng.integers(5, 24)), colour, -1, cv2.LINE_AA)
        else:
            box = cv2.boxPoints((at, rng.uniform(8, 48, 2).tolist(), float(rng.uniform(0, 180))))
            cv2.fillPoly(picture, [box.astype(np.int32)], colour, cv2.LINE_AA)
    return cv2.resize(picture, (SIZE, SIZE), interpolation=cv2.INTER_AREA)
