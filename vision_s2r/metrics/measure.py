"""All metrics of one translator in one column, on disk."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from vision_s2r.evaluate.rows import Runner
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.files import write
from vision_s2r.images import to_float
from vision_s2r.metrics.colours import classes_of
from vision_s2r.metrics.objects import OBJECT, compare
from vision_s2r.metrics.q_difference import QDifference
from vision_s2r.translate.metrics import overlap, picture_metrics

DEFINITIONS = 1  # of all metrics; another number measures everything again
CHUNK = 64  # scenes at a time

# By metric float64 [N, 2], numerator and denominator in each scene.
Measures = dict[str, np.ndarray]


class Measurer:
    """Measures translations of the scenes of one evaluation."""

    def __init__(self, scenes: Scenes) -> None:
        views = scenes.views
        self._canonical, self._segmentation = views.all("canonical"), views.all("segmentation")
        self._instance = views.all("instance")
        self._q_difference = QDifference(scenes)

    def __call__(self, runner: Runner, source: Tensor) -> Measures:
        """Of the row's translations of `source`, uint8 [N, H, W, 3], the pictures of all scenes.

        l1, psnr, ssim and object_l1 as in `picture_metrics`; object_iou of the objects that the translation itself
        shows (`classes_of`); q_difference as `QDifference`; the rest as `Content.measures`.
        """
        translated = runner.look(source, self._canonical)
        chunks = [self._pictures(translated, some) for some in torch.arange(len(source)).split(CHUNK)]
        found = {name: np.concatenate([chunk[name] for chunk in chunks]) for name in chunks[0]}
        difference = self._q_difference(runner, translated, source).double().numpy()
        return found | {"q_difference": np.stack([difference, np.ones_like(difference)], 1)}

    def _pictures(self, translated: Tensor, some: Tensor) -> Measures:
        picture, mask = translated[some], self._segmentation[some] == OBJECT
        found = classes_of(picture.numpy())
        tensors = picture_metrics(to_float(picture), to_float(self._canonical[some]), mask)
        tensors["object_iou"] = overlap(torch.from_numpy(found == OBJECT), mask)
        truth = zip(self._segmentation[some].numpy(), self._instance[some].numpy(), strict=True)
        contents = [compare(each, *true).measures() for each, true in zip(found, truth, strict=True)]
        rates = {name: np.array([content[name] for content in contents], float) for name in contents[0]}
        return {name: tensor.double().numpy() for name, tensor in tensors.items()} | rates


def stored(folder: Path, key: str, measured: Callable[[], Measures]) -> Measures:
    """What lies in the folder under the fingerprint `key`, else what is measured now, and written there."""
    path = folder / f"{key}.json"
    try:
        return {name: np.array(values, float).reshape(-1, 2) for name, values in json.loads(path.read_text()).items()}
    except (OSError, ValueError, AttributeError):
        found = measured()
        write(path, json.dumps({name: values.tolist() for name, values in found.items()}))
        return found
