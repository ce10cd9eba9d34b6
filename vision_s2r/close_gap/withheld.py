"""Cameras that nobody has seen: drawn, photographed with by code that is not the diagnosis', and kept aside."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from vision_s2r import files
from vision_s2r.errors import UserError, nearest
from vision_s2r.gapbench.generate import camera_effects as studio
from vision_s2r.recording import CameraRecording, write
from vision_s2r.render import Views

EFFECTS = 3  # of each camera
# Strong enough to cost grasps; px are meant for pictures of 64.
RANGES: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "camera_pose_offset": {"yaw": (0.02, 0.04), "pitch": (-0.04, -0.02), "roll": (0.03, 0.08)},
    "uneven_illumination": {"strength": (0.5, 0.9), "angle": (-180, 180)},
    "cast_shadow": {"strength": (0.5, 0.8), "offset": (-10, 10), "angle": (-180, 180), "softness": (1, 4)},
    "lens_distortion": {"k1": (-0.5, -0.3), "k2": (0.0, 0.05)},
    "chromatic_aberration": {"red": (0.02, 0.04), "blue": (-0.04, -0.02)},
    "vignetting": {"strength": (0.7, 0.95)},
    "defocus_blur": {"radius": (1.8, 3.2)},
    "motion_blur": {"length": (4.0, 8.0), "angle": (-90, 90)},
    "low_resolution": {"factor": (1.7, 2.5)},
    "exposure": {"stops": (-2.0, -1.2)},
    "shot_noise": {"full_well": (80, 300)},
    "read_noise": {"sigma": (0.015, 0.035)},
    "white_balance": {"red": (1.4, 1.8), "blue": (0.4, 0.6)},
    "gamma": {"gamma": (1.6, 2.2)},
    "jpeg_compression": {"quality": (10, 25)},
}


@dataclass(frozen=True)
class Withheld:
    """A camera's recording, and the file with what the diagnosis is not told."""

    name: str
    recording: Path
    truth: Path | None


def withhold(views: Views, count: int, frames: int, effects: Sequence[str], seed: int, out: Path) -> list[Withheld]:
    """`count` cameras of three effects each, every one with `frames` pictures of real looks in `views`.

    The recording's simulator is a digital twin of what the camera looks at. What is there already stays: a seed
    always draws the same cameras. Raises UserError for an unknown effect.
    """
    for name in effects:
        if name not in RANGES:
            raise UserError(f"close_gap.effects: no effect is called '{name}': {nearest(name, RANGES)}")
    allowed = list(effects) or list(RANGES)
    return [_camera(views, frames, allowed, seed, k, out / f"camera-{k}") for k in range(count)]


def _camera(views: Views, frames: int, allowed: Sequence[str], seed: int, k: int, folder: Path) -> Withheld:
    rng = np.random.default_rng([seed, k])
    names = sorted(rng.choice(allowed, min(EFFECTS, len(allowed)), replace=False), key=studio.EFFECTS.index)
    values = {str(name): {key: float(rng.uniform(*ends)) for key, ends in RANGES[name].items()} for name in names}
    if "jpeg_compression" in values:
        values["jpeg_compression"]["quality"] = float(round(values["jpeg_compression"]["quality"]))
    recording, truth_file = folder / "recording", folder / "truth.yaml"
    if not truth_file.exists():
        shutil.rmtree(recording, ignore_errors=True)
        write(_recording(views, frames, values, rng), recording)
        truth = {"reference_size": views.size, "effects": {n: {"probability": 1.0, **v} for n, v in values.items()}}
        files.write(truth_file, yaml.safe_dump(truth, sort_keys=False))
    return Withheld(folder.name, recording, truth_file)


def _recording(views: Views, frames: int, values: studio.Values, rng: np.random.Generator) -> CameraRecording:
    chosen = rng.choice(len(views), min(frames, len(views)), replace=False)
    canvas = views.all("real").numpy()[chosen] / 255
    fx, fy, cx, cy = views.all("intrinsics").numpy()[chosen[0]]
    geometry = studio.Geometry(views.size, views.size, fx, fy, cx, cy, views.margin)
    real = studio.photograph(canvas, values, geometry, studio.Sensor(), rng)
    names = tuple(f"{i:04d}" for i in range(len(chosen)))
    return CameraRecording(
        pairing="paired",
        encoding="srgb",
        sim=geometry.crop(canvas).astype(np.float32),
        real=(real / 255).astype(np.float32),
        labels=None,
        mask=None,
        intrinsics=np.array([fx, fy, cx, cy]),
        bits=8,
        grey=False,
        names=names,
        real_names=names,
    )
