"""A contact sheet: the first scenes of a set, a column each, their pictures below one another."""

from pathlib import Path

import cv2
import numpy as np
import torch

from vision_s2r import files
from vision_s2r.render.views import Views

SCENES = 10
CELL = 128  # px
LABEL_COLOURS = np.array([[60, 60, 70], [200, 195, 175], [64, 115, 190], [217, 64, 64], [77, 190, 90]], dtype=np.uint8)


def write(views: Views, path: Path) -> None:
    """Write the sheet as PNG: randomized views, real (with their margins), canonical, segmentation, depth."""
    some = views.subset(range(min(SCENES, len(views))))
    columns = [np.concatenate(list(_column(some, torch.tensor([k])))) for k in range(len(some))]
    _, encoded = cv2.imencode(".png", np.concatenate(columns, axis=1)[..., ::-1])
    files.write(path, encoded.tobytes())


def _column(views: Views, index: torch.Tensor) -> list[np.ndarray]:
    pictures = []
    if "randomized" in views.names:
        pictures += list(views.batch("randomized", index)[0].numpy())
    if "real" in views.names:
        pictures.append(views.batch("real", index)[0].numpy())
    pictures.append(views.batch("canonical", index)[0].numpy())
    pictures.append(LABEL_COLOURS[views.batch("segmentation", index)[0].numpy()])
    depth = views.batch("depth", index)[0].numpy()
    near = 255 * (1 - (depth - depth.min()) / max(float(np.ptp(depth)), 1e-6))
    pictures.append(np.repeat(near.astype(np.uint8)[..., None], 3, axis=2))
    return [cv2.resize(p, (CELL, CELL), interpolation=cv2.INTER_NEAREST) for p in pictures]
