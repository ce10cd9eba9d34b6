"""The columns of the table: which pictures of a scene a policy is given."""

import zlib
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraConfig, CameraParameters, load_config
from vision_s2r.cli import CONFIGS
from vision_s2r.errors import UserError, nearest
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.images import to_float, to_uint8
from vision_s2r.render import Views
from vision_s2r.threads import one_thread
from vision_s2r.training.data import generator

# As in the presets: an effect alone means the same at every size of picture.
REFERENCE_SIZE = 128


@dataclass(frozen=True)
class Column:
    """One kind of picture: a rendered appearance, through a camera or a perfect one (None)."""

    name: str
    appearance: str  # canonical | randomised | real
    camera: CameraConfig | None = None


def columns(cfg: EvaluateConfig) -> list[Column]:
    """The appearances, then the real one through each camera, then through each effect alone.

    A camera is a name in configs/camera, or a YAML file of the same form, whose stem names the column.

    Raises UserError, with the nearest name, for a camera or an effect that there is none of.
    """
    found = [Column(name, name) for name in cfg.appearances]
    for name in cfg.cameras:
        is_file = name.endswith(".yaml")
        found.append(Column(Path(name).stem, "real", load_config(Path(name)) if is_file else _preset(name)))
    for name in cfg.effects:
        alone = {name: CAMERA_EFFECTS[name].moderate()}
        found.append(Column(name, "real", CameraConfig(effects=alone, reference_size=REFERENCE_SIZE)))
    return found


def preset_of(camera: dict[str, Any] | None) -> str | None:
    """The name in configs/camera of a camera's configuration; None for any other."""
    return next((name for name, preset in _presets().items() if asdict(preset) == camera), None)


@cache
def _presets() -> dict[str, CameraConfig]:
    return {path.stem: load_config(path) for path in sorted((CONFIGS / "camera").glob("*.yaml"))}


def _preset(name: str) -> CameraConfig:
    if name not in _presets():
        raise UserError(f"evaluate.cameras: no camera '{name}' in configs/camera, {nearest(name, _presets())}")
    return _presets()[name]


def pictures(column: Column, views: Views, seed: int) -> Tensor:
    """The column's picture of each scene, uint8 [N, H, W, 3].

    Each is a function of (scene, column, seed) alone, pixel for pixel, whatever other scenes there are.
    """
    if column.appearance == "canonical":
        return views.all("canonical")
    source = views.all(column.appearance)
    if column.appearance == "randomised":
        source = source[:, 0]
    m = views.margin
    if column.camera is None:
        return source[:, m : m + views.size, m : m + views.size].contiguous()
    camera = Camera.from_config(column.camera)
    intrinsics = views.all("intrinsics")
    seen = []
    with one_thread():  # several lose more in handing over such small pictures than they gain
        # One by one: convolutions over a batch differ in the last bit with the size of the batch.
        for i, scene in enumerate(views.all("seed_and_index").tolist()):
            parameters = _parameters(camera, column, views.size, scene, seed)
            seen.append(to_uint8(camera(to_float(source[i : i + 1]), parameters, m, intrinsics[i : i + 1])))
    return torch.cat(seen)


def _parameters(camera: Camera, column: Column, size: int, scene: list[int], seed: int) -> CameraParameters:
    key = zlib.crc32(column.name.encode())
    return camera.sample(1, generator(key, seed, *scene), size, size)
