"""The camera's configuration: which effects, how often, and in which ranges."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, cast, get_args

from vision_s2r.camera.effect import CAMERA_EFFECTS, Encoding, Interpolation, JpegForm
from vision_s2r.errors import UserError, check_keys
from vision_s2r.options import option, validate
from vision_s2r.randomize import effect_ranges, files


@dataclass
class CameraConfig:
    """A camera as configs/camera/*.yaml has it."""

    effects: dict[str, dict[str, Any]] = option(
        {}, "By effect: probability (1 if left out) and each of its parameters, a number or [low, high]."
    )
    encoding: str = option("srgb", "What pixel values mean; linear: of raw sensors.", choices=get_args(Encoding))
    interpolation: str = option(
        "bicubic",
        "Between pixels, for warps and the path of motion blur; bilinear takes a third of the time.",
        choices=get_args(Interpolation),
    )
    jpeg: str = option(
        "codec",
        "codec (libjpeg, no gradient) or differentiable (the same in torch, with gradients).",
        choices=get_args(JpegForm),
    )
    reference_size: int | None = option(
        None,
        "Shorter side of the pictures for which values in px are meant, px; at another size they scale with it. null: "
        "they are meant as they are at any size.",
        low=1,
    )


def load_config(path: Path) -> CameraConfig:
    """The checked configuration in a YAML file; UserError where it cannot be."""
    content = files.read(path, "camera")
    check_keys(content, [each.name for each in fields(CameraConfig)], f"camera {path}")
    config = CameraConfig(**cast(dict[str, Any], content))
    try:
        check(config)
    except UserError as error:
        raise UserError(f"camera {path}: {error}") from error
    return config


def check(config: CameraConfig) -> None:
    """UserError unless every key and value of the configuration can be."""
    validate(config)
    effect_ranges(config.effects, CAMERA_EFFECTS)
