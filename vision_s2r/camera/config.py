"""The camera's configuration: which effects, how often, and in which ranges."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, cast, get_args

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from vision_s2r.camera.effect import CAMERA_EFFECTS, Encoding, Interpolation, JpegForm
from vision_s2r.errors import UserError, nearest


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


@dataclass(frozen=True)
class EffectRange:
    """How an effect is drawn: with what probability it is on, and the range [low, high] of each parameter."""

    probability: float
    ranges: dict[str, tuple[float, float]]


def load_config(path: Path) -> CameraConfig:
    """The checked configuration in a YAML file; UserError where it cannot be."""
    try:
        content = OmegaConf.to_container(OmegaConf.load(path), resolve=True)
    except (OSError, YAMLError, OmegaConfBaseException) as error:
        raise UserError(f"cannot read camera {path}: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise UserError(f"camera {path}: expected keys and values")
    known = [each.name for each in fields(CameraConfig)]
    for key in content:
        if key not in known:
            raise UserError(f"camera {path}: no key {key!r}, {nearest(str(key), known)}")
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
    effect_ranges(config.effects)


def effect_ranges(effects: Mapping[str, Mapping[str, Any]]) -> dict[str, EffectRange]:
    """The `effects` of a configuration, checked and typed; UserError where they cannot be."""
    return {name: _effect_range(name, given) for name, given in effects.items()}


def _effect_range(name: str, given: Mapping[str, Any]) -> EffectRange:
    effect = CAMERA_EFFECTS[name]
    if not isinstance(given, Mapping):
        raise UserError(f"{name} is {given!r}, expected its parameters")
    probability = given.get("probability", 1.0)
    if isinstance(probability, bool) or not isinstance(probability, int | float) or not 0 <= probability <= 1:
        raise UserError(f"{name}: probability is {probability!r}, expected 0 to 1")
    ranges = {key: _range(name, key, value) for key, value in given.items() if key != "probability"}
    low = effect.check({key: low for key, (low, _) in ranges.items()})
    high = effect.check({key: high for key, (_, high) in ranges.items()})
    for key in low:
        if low[key] > high[key]:
            raise UserError(f"{name}: {key} is [{low[key]:g}, {high[key]:g}], expected low before high")
        if low[key] != high[key] == float("inf"):
            raise UserError(f"{name}: {key} is [{low[key]:g}, inf], expected a finite range to draw from")
    return EffectRange(float(probability), {key: (low[key], high[key]) for key in low})


def _range(effect: str, parameter: str, value: Any) -> tuple[Any, Any]:
    if not isinstance(value, Sequence) or isinstance(value, str):
        return value, value
    if len(value) != 2:
        raise UserError(f"{effect}: {parameter} is {list(value)}, expected a number or [low, high]")
    return value[0], value[1]
