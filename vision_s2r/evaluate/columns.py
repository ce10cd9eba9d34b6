"""The columns of the table: which pictures of a scene a policy is given."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraConfig, load_config
from vision_s2r.camera.presets import preset
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.render import Views
from vision_s2r.render.again import rendered
from vision_s2r.render.seen import through
from vision_s2r.scene import real
from vision_s2r.scene.changes import changed, known
from vision_s2r.training.data import generator

# As in the presets: an effect alone means the same at every size of picture.
REFERENCE_SIZE = 128


@dataclass(frozen=True)
class Column:
    """One kind of picture: a rendered appearance, through a camera or a perfect one (None); the real one may change."""

    name: str
    appearance: str  # canonical | randomized | real
    camera: CameraConfig | None = None
    changes: Mapping[str, float] = field(default_factory=dict)  # of the real look, by name: how far


def columns(cfg: EvaluateConfig) -> list[Column]:
    """The appearances, then the real one through each camera, then through each effect alone, then with each change.

    A camera is a name in configs/camera, or a YAML file of the same form, whose stem names the column.

    Raises UserError, with the nearest name, for a camera, an effect or a change that there is none of.
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
    for name, changes in cfg.changes.items():
        known(changes)
        found.append(Column(name, "real", changes=changes))
    return found


def pictures(column: Column, views: Views, seed: int) -> Tensor:
    """The column's picture of each scene, uint8 [N, H, W, 3]; source pictures as large as a camera sees them.

    Each is a function of (scene, column, seed) alone, pixel for pixel, whatever other scenes there are.
    """
    if column.appearance == "canonical":
        scale = views.source_size // views.size
        return views.all("canonical").repeat_interleave(scale, 1).repeat_interleave(scale, 2)
    if column.changes:
        return rendered(views, lambda scene, state: changed(real(scene, state), column.changes))
    source = views.all(column.appearance)
    if column.appearance == "randomized":
        source = source[:, 0]
    m = views.margin
    if column.camera is None:
        return source[:, m : m + views.source_size, m : m + views.source_size].contiguous()
    key = zlib.crc32(column.name.encode())
    return through(views, source, Camera.from_config(column.camera), lambda scene: generator(key, seed, *scene))
