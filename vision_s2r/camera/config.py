"""The camera's configuration: which effects, how often, and in which ranges."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, cast, get_args

from vision_s2r.camera.effect import CAMERA_EFFECTS, Encoding, Interpolation, JpegForm
from vision_s2r.errors import UserError, nearest
from vision_s2r.randomize import effect_ranges, files


@dataclass
class CameraConfig:
    """A camera as configs/camera/*.yaml has it."""

    # By effect: probability (1 if left out) and each of its parameters, a number or [low, high].
    effects: dict[str, dict[str, Any]] = field(default_factory=dict)
    encoding: str = "srgb"  # what pixel values mean: srgb | linear
    interpolation: str = "bicubic"  # of warps and of the path of motion blur: bicubic | bilinear
    jpeg: str = "codec"  # codec (libjpeg, no gradient) | differentiable
    # Shorter side (px) of the pictures for which values in px are meant; at another size they scale. Unset:
    # they are meant as they are at any size.
    reference_size: int | None = None


def load_config(path: Path) -> CameraConfig:
    """The checked configuration in a YAML file; UserError where it cannot be."""
    content = files.read(path, "camera")
    files.check_keys(content, [each.name for each in fields(CameraConfig)], f"camera {path}")
    config = CameraConfig(**cast(dict[str, Any], content))
    try:
        check(config)
    except UserError as error:
        raise UserError(f"camera {path}: {error}") from error
    return config


def check(config: CameraConfig) -> None:
    """UserError unless every key and value of the configuration can be."""
    for key, choices in (("encoding", Encoding), ("interpolation", Interpolation), ("jpeg", JpegForm)):
        value = getattr(config, key)
        if value not in get_args(choices):
            raise UserError(f"{key} is '{value}': {nearest(str(value), get_args(choices))}")
    if config.reference_size is not None and config.reference_size < 1:
        raise UserError(f"reference_size is {config.reference_size}, expected at least 1 px")
    effect_ranges(config.effects, CAMERA_EFFECTS)
