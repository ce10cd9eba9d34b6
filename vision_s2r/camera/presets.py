"""The cameras of configs/camera, by name."""

from dataclasses import asdict
from functools import cache
from typing import Any

from vision_s2r.camera.config import CameraConfig, load_config
from vision_s2r.errors import UserError, nearest
from vision_s2r.paths import CONFIGS


@cache
def presets() -> dict[str, CameraConfig]:
    """All of them."""
    return {path.stem: load_config(path) for path in sorted((CONFIGS / "camera").glob("*.yaml"))}


def preset(name: str, key: str) -> CameraConfig:
    """The camera of that name. Raises UserError, with the configuration's `key`, where there is none."""
    if name not in presets():
        raise UserError(f"{key}: no camera '{name}' in configs/camera, {nearest(name, presets())}")
    return presets()[name]


def preset_of(camera: dict[str, Any] | None) -> str | None:
    """The name of a camera's configuration; None for any other."""
    return next((name for name, known in presets().items() if asdict(known) == camera), None)
