"""The columns of the table: which pictures of a scene a policy is given."""

import zlib
from dataclasses import dataclass
from pathlib import Path

from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraConfig, load_config
from vision_s2r.camera.presets import preset
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.render import Views
from vision_s2r.render.seen import through
from vision_s2r.training.data import generator

# As in the presets: an effect alone means the same at every size of picture.
REFERENCE_SIZE = 128


@dataclass(frozen=True)
class Column:
    """One kind of picture: a rendered appearance, through a camera or a perfect one (None)."""

    name: str
    appearance: str  # canonical | randomized | real
    camera: CameraConfig | None = None


def columns(cfg: EvaluateConfig) -> list[Column]:
    """The appearances, then the real one through each camera, then through each effect alone.

    A camera is a name in configs/camera, or a YAML file of the same form, whose stem names the column.

    Raises UserError, with the nearest name, for a camera or an effect that there is none of.
    """
    found = [Column(name, name) for name in cfg.appearances]
    for name in cfg.cameras:
        is_file = name.endswith(".yaml")
        found.append(
            Column(Path(name).stem, "real", load_config(Path(name)) if is_file else preset(name, "evaluate.cameras"))
        )
    for name in cfg.effects:
        alone = {name: CAMERA_EFFECTS[name].moderate()}
        found.append(Column(name, "real", CameraConfig(effects=alone, reference_size=REFERENCE_SIZE)))
    return found


def pictures(column: Column, views: Views, seed: int) -> Tensor:
    """The column's picture of each scene, uint8 [N, H, W, 3].

    Each is a function of (scene, column, seed) alone, pixel for pixel, whatever other scenes there are.
    """
    if column.appearance == "canonical":
        return views.all("canonical")
    source = views.all(column.appearance)
    if column.appearance == "randomized":
        source = source[:, 0]
    m = views.margin
    if column.camera is None:
        return source[:, m : m + views.size, m : m + views.size].contiguous()
    key = zlib.crc32(column.name.encode())
    return through(views, source, Camera.from_config(column.camera), lambda scene: generator(key, seed, *scene))
