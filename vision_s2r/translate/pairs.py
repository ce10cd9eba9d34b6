"""Pairs to learn from: a source picture as a camera sees it, and what its canonical view is."""

from torch import Tensor

from vision_s2r.camera import Camera, CameraParameters, sources
from vision_s2r.images import to_float
from vision_s2r.networks import rectification
from vision_s2r.networks.rectifier import POINTS
from vision_s2r.training import Batch, Draw, ViewSource
from vision_s2r.training.data import randomized
from vision_s2r.translate.config import TranslateConfig

TARGETS = ("canonical", "segmentation", "depth", "intrinsics")
CAMERA, LABELS = ("intrinsics", "extrinsics"), ("grasps", "success")  # what a frozen Q reads beside the pictures


class Pairs:
    """Reads what the losses of a configuration need, and makes source and target of it."""

    def __init__(self, cfg: TranslateConfig, margin: int, depth_range: tuple[float, float], labelled: bool = False):
        """`margin`: pixels by which source pictures are wider; `depth_range`: nearest and farthest, metres.

        `labelled`: whether a policy judges the pictures: targets then have its camera, held-out ones labelled grasps.
        """
        self._shuffles = cfg.shuffle_colours
        self._rectifies, self._labels = rectifies(cfg), LABELS if labelled else ()
        self.names = needed(cfg, labelled)
        self._margin, self._depth_range = margin, depth_range

    def drawn(self, views: ViewSource, draw: Draw) -> Batch:
        """The tensors of a training step, one randomized picture of each scene as its source."""
        batch = {name: views.batch(name, draw.indices) for name in self.names}
        return batch | {"source": randomized(views, draw, self._shuffles)}

    def held_out(self, views: ViewSource, indices: Tensor, look: str) -> Batch:
        """The tensors of held-out scenes, the (first) picture of a look as the source."""
        batch = {name: views.batch(name, indices) for name in (*self.names, *self._labels)}
        pictures = views.batch(look, indices)
        return batch | {"source": pictures[:, 0] if look == "randomized" else pictures}

    def __call__(self, batch: Batch, camera: Camera, parameters: CameraParameters) -> tuple[Tensor, Batch]:
        """The sources through a camera, as networks read them, float [B, 3, H, W] in [0, 1], and their targets."""
        size, target = batch["canonical"].shape[1], self._target(batch)
        if self._rectifies:
            truth = rectification.displacements(batch, parameters, size, POINTS)
            target["displacements"] = truth.to(batch["source"].device)
        return sources.read(camera, batch["source"], parameters, self._margin, batch["intrinsics"], size), target

    def _target(self, batch: Batch) -> Batch:
        near, far = self._depth_range
        return {
            "canonical": to_float(batch["canonical"]),
            "segmentation": batch["segmentation"].long(),
            "depth": ((batch["depth"] - near) / (far - near)).unsqueeze(1),
        } | {name: batch[name].float() for name in (*CAMERA, *LABELS) if name in batch}


def rectifies(cfg: TranslateConfig) -> bool:
    """Whether there is a rectifier that is told where to look."""
    return cfg.network.rectifier > 0 and cfg.loss.rectification > 0


def needed(cfg: TranslateConfig, labelled: bool = False) -> tuple[str, ...]:
    """The tensors of the views that training reads, but for the source pictures."""
    sources = rectification.SOURCES if rectifies(cfg) else ()
    return tuple(dict.fromkeys((*TARGETS, *sources, *(CAMERA if labelled else ()))))
