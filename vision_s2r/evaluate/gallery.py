"""What a translator makes of the test scenes: a sheet of each column's pictures, their translations and the truth."""

from pathlib import Path

import cv2
import numpy as np
import torch

from vision_s2r.camera.presets import preset
from vision_s2r.errors import UserError
from vision_s2r.evaluate.columns import Column, pictures
from vision_s2r.evaluate.drawing import png, sheet
from vision_s2r.files import write
from vision_s2r.images import reduced
from vision_s2r.render import Views
from vision_s2r.translate import Translator

SIDE = 128  # px: of a picture on the sheet


def gallery(translator: str, scenes: str, cameras: list[str], count: int, out: Path, seed: int = 0) -> Path:
    """Writes a PNG with two lines a column, seen and translated, over one of the truth; returns its path.

    Columns are the real look and each of `cameras` (configs/camera) on it; of the folder `scenes` the first `count` are
    shown. `seed`: of the cameras' parameters, as in an evaluation. Raises UserError for names that there are none of.
    """
    views = Views.open(scenes)
    if not 0 < count <= len(views):
        raise UserError(f"gallery of {count} scenes: {scenes} has {len(views)}")
    views = views.subset(range(count))
    network = Translator.load(translator)
    seen = [Column("real", "real")] + [Column(name, "real", preset(name, "gallery")) for name in cameras]
    lines: dict[str, np.ndarray] = {}
    for column in seen:
        source = pictures(column, views, seed)
        lines[column.name] = _line(source)
        lines[f"{column.name}_translated"] = _line(network(reduced(source, network.size)))
    lines["truth"] = _line(views.all("canonical"))
    return write(out, png(sheet(lines)))


def _line(images: torch.Tensor) -> np.ndarray:
    """Pictures uint8 [N, H, H, 3] side by side, enlarged."""
    joined = np.concatenate(list(images.numpy()), axis=1)
    return cv2.resize(joined, (SIDE * len(images), SIDE), interpolation=cv2.INTER_NEAREST)
