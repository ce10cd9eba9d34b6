"""Effects added to real photographs: what the diagnosis makes of one that is known to be there.

A camera that took these photographs, and has one effect more, would have taken them with it; what else the real one
does stays real. Drawn by the benchmark's camera, of which the diagnosis' simulator has no line.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.camera.camera import default_intrinsics
from vision_s2r.gapbench.generate.camera_effects import Geometry, Sensor, Values, photograph
from vision_s2r.hardware.added import Added
from vision_s2r.recording import CameraRecording

JPEG = "jpeg_compression"
SENSOR = Sensor(kernel="cubic", sigma=0.0)
LOWER = 0.25  # times the quality that JPEG has already


def with_effects(recording: CameraRecording, report: Mapping[str, Any]) -> Iterator[Added]:
    """Paired photographs with each effect added, one at a time, that can be, encoded as their `report` says they are.

    Not white balance and chromatic aberration to pictures without colour, nor a pose where no lens is known.
    """
    found = {each["name"]: each["parameters"] for each in report["effects"]}
    quality = found[JPEG]["quality"]["value"] if JPEG in found else None
    jpeg = {} if quality is None else {JPEG: {"quality": quality}}
    for effect, values in _effects(recording, quality).items():
        first = CAMERA_EFFECTS[effect].parameters[0]
        neutral = first.neutral if first.neutral is not None and np.isfinite(first.neutral) else 0.0
        real = _taken(recording, {**jpeg, effect: values})
        yield Added(effect, values, neutral, first.unit, replace(recording, real=real), instead=effect == JPEG)


def _effects(recording: CameraRecording, quality: float | None) -> dict[str, dict[str, float]]:
    """Each effect as strong as is common; blurs and shadows by the pictures' width."""
    width = recording.real.shape[2]
    found = {
        "exposure": {"stops": -0.6},
        "gamma": {"gamma": 1.25},
        "vignetting": {"strength": 0.45},
        "uneven_illumination": {"strength": 0.35, "angle": 30.0},
        "cast_shadow": {"strength": 0.5, "offset": 0.09 * width, "angle": -40.0, "softness": 0.03 * width},
        "defocus_blur": {"radius": 0.011 * width},
        "motion_blur": {"length": 0.03 * width, "angle": 30.0},
        "low_resolution": {"factor": 0.0125 * width},
        "shot_noise": {"full_well": 100.0},
        "read_noise": {"sigma": 0.04},
    }
    if recording.intrinsics is not None:
        found["camera_pose_offset"] = {"yaw": 0.02, "pitch": -0.015, "roll": 0.03}
    if not recording.grey:
        found |= {"white_balance": {"red": 1.15, "blue": 0.9}, "chromatic_aberration": {"red": 0.01, "blue": -0.01}}
    return found if quality is None else found | {JPEG: {"quality": round(LOWER * quality)}}


def _taken(recording: CameraRecording, values: Values) -> np.ndarray:
    """The photographs [N, H, W, 3] as a camera with these effects takes them."""
    height, width = recording.real.shape[1:3]
    intrinsics = default_intrinsics(height, width) if recording.intrinsics is None else recording.intrinsics
    fx, fy, cx, cy = map(float, intrinsics)
    geometry = Geometry(width, height, fx, fy, cx, cy, margin=0)
    sensor = replace(SENSOR, linear=recording.encoding == "linear", bits=recording.bits)
    scenes = recording.real[..., :1] if recording.grey else recording.real
    taken = photograph(scenes.astype(np.float64), values, geometry, sensor, np.random.default_rng(0))
    return np.broadcast_to(taken / (2**recording.bits - 1), recording.real.shape).astype(np.float32)
