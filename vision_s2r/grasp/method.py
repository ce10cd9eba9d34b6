"""Learning Q from labelled grasps: each attempt ends at once, so Q is the chance that it succeeds."""

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera import Camera, CameraConfig, sources
from vision_s2r.errors import UserError
from vision_s2r.grasp import augment, negatives
from vision_s2r.grasp.config import GraspConfig, check
from vision_s2r.grasp.forms import build, load_configuration
from vision_s2r.grasp.metrics import measure
from vision_s2r.grasp.q_function import GraspScores
from vision_s2r.images import to_float
from vision_s2r.networks import rectification
from vision_s2r.networks.rectifier import POINTS
from vision_s2r.training import Batch, Draw, Inputs, Method, Step, ViewSource, checkpoint, muon_and_adamw, train
from vision_s2r.training.data import randomized, require, require_alike

CHUNK = 64  # scenes at a time in validation
LABELS = ("intrinsics", "extrinsics", "grasps", "success")
SOURCES = ("randomized", "real")
NETWORK = ("form", "width", "plane_height", "front", "crop", "dense")  # what shapes it


class QLearning(Method):
    """Binary cross-entropy on the labels of all grasps of a scene, which share one encoding of its picture.

    Q looks at canonical pictures, slightly degraded as a translator's are, or at those that a robot recorded; or at
    source pictures through a camera (domain randomization); or at canonical and source pictures.
    """

    kind = "q_function"
    released = ("q_function",)

    def __init__(
        self,
        cfg: GraspConfig,
        camera: CameraConfig,
        validation_camera: CameraConfig,
        size: int,
        margin: int,
    ):
        """`size`: side of a picture; `margin`: by which source pictures are wider on each side; pixels."""
        self._cfg, self._size, self._margin = cfg, size, margin
        self._camera, self._validation_camera = (Camera.from_config(c) for c in (camera, validation_camera))
        network = build(cfg)
        if cfg.start:
            checkpoint.load(cfg.start, self.kind).restore("q_function", network)
        self.fine_tunes = bool(cfg.start)
        if cfg.training.compile and network.front:
            network.front.compile(dynamic=False)
        self.networks = {"q_function": network}
        self.optimizers = {"q_function": muon_and_adamw(network, cfg.training)}
        cameras = {"camera": asdict(camera), "validation_camera": asdict(validation_camera)}
        self.configuration = asdict(cfg) | cameras
        self.normalization = {"size": size}

    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        names = _read_in_training(self._cfg)
        batch = {name: views.batch(name, draw.indices) for name in names if name != "randomized"}
        if "randomized" in names:
            batch["randomized"] = randomized(views, draw, self._cfg.shuffle_colours)
        return batch | _labels(views, draw.indices)

    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        canonical = source = None
        if "randomized" in batch:
            source, truth = self._seen(batch["randomized"], batch, self._camera, step.generator)
            batch = batch | truth
        if self._cfg.picture in batch and self._cfg.picture != "randomized":
            canonical = to_float(batch[self._cfg.picture])
            canonical = augment.degrade(canonical, self._cfg.augmentation, step.generator)
        batch = batch | {"images": beside(canonical, source), "weight": torch.ones_like(batch["success"])}
        if self._cfg.negatives:
            batch = negatives.add(batch, self._cfg.negatives, self._cfg.area, step.generator)
        batch = augment.turn(batch, step.generator)
        if self._cfg.augmentation.mirror:
            batch = augment.mirror(batch, step.generator)
        scores = self._scores(batch)
        losses = {"bce": F.binary_cross_entropy_with_logits(scores.logits.float(), batch["success"], batch["weight"])}
        total = losses["bce"]
        if "displacements" in batch:
            assert scores.displacements is not None
            losses["rectification"] = rectification.loss(scores.displacements, batch["displacements"])
            total = total + self._cfg.rectification * losses["rectification"]
        step.optimize(total, "q_function")
        return losses

    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        """As `measure`, over the attempts in the validation views.

        With the rectifier's loss also rectification_error, of the places that it samples (px).
        """
        logits, success, off = [], [], []
        for indices in torch.arange(len(views)).split(CHUNK):
            batch = {name: views.batch(name, indices) for name in _read(self._cfg, self._cfg.validate_on)}
            batch = {name: t.to(self.device) for name, t in (batch | _labels(views, indices)).items()}
            given = self._cfg.picture != "randomized"
            canonical = to_float(batch[self._cfg.picture]) if given else None
            source = batch.get(self._cfg.validate_on) if self._cfg.validate_on in SOURCES else None
            if source is not None:
                source = source[:, 0] if self._cfg.validate_on == "randomized" else source
                source, truth = self._seen(source, batch, self._validation_camera, generator)
                batch |= truth
            batch["images"] = beside(canonical, source)
            scores = self._scores(batch)
            logits.append(scores.logits.cpu())
            success.append(batch["success"].cpu())
            if "displacements" in batch:
                assert scores.displacements is not None
                off.append(rectification.error(scores.displacements, batch["displacements"], views.size).cpu())
        found = measure(torch.cat(logits), torch.cat(success))
        return found | ({"rectification_error": float(torch.cat(off).mean())} if off else {})

    def _scores(self, batch: Batch) -> GraspScores:
        return self.networks["q_function"](*(batch[k] for k in ("images", "intrinsics", "extrinsics", "grasps")))

    def _seen(self, source: Tensor, batch: Batch, camera: Camera, generator: torch.Generator) -> tuple[Tensor, Batch]:
        """Source pictures uint8 [B, H+2m, W+2m, 3] through a camera, as Q reads them: float [B, 3, size, size].

        With the rectifier's loss also the `displacements` that it should find, seen by the cameras of `batch`.
        """
        side = sources.side(source, self._margin)
        parameters = camera.sample(len(source), generator, side, side)
        seen = sources.read(camera, source, parameters, self._margin, batch["intrinsics"], self._size)
        if not self._cfg.rectification:
            return seen, {}
        truth = rectification.displacements(batch, parameters, self._size, POINTS)
        return seen, {"displacements": truth.to(seen.device)}


def pictures(cfg: GraspConfig, source: str) -> list[str]:
    """Names of the pictures that Q looks at, its sources being `source`."""
    names = [] if cfg.picture == "randomized" else [cfg.picture]
    return [*names, source] if cfg.with_source or cfg.picture == "randomized" else names


def _read(cfg: GraspConfig, source: str) -> list[str]:
    """All that Q and its rectifier's truth are made of, the sources being `source`."""
    truth = rectification.SOURCES if cfg.rectification else ()
    return list(dict.fromkeys((*pictures(cfg, source), *truth)))


def _read_in_training(cfg: GraspConfig) -> list[str]:
    """All that training reads but for the labels."""
    return [
        *_read(cfg, "randomized"),
        *(["segmentation"] if cfg.negatives else []),
    ]


def beside(canonical: Tensor | None, source: Tensor | None) -> Tensor:
    """What a Q-function is given: the canonical picture's channels, then the source's, of those there are."""
    return torch.cat([picture for picture in (canonical, source) if picture is not None], 1)


def _labels(views: ViewSource, indices: Tensor) -> Batch:
    labels = {name: views.batch(name, indices) for name in LABELS}
    return labels | {name: labels[name].float() for name in ("grasps", "success")}


def _begun(cfg: GraspConfig) -> GraspConfig:
    """The configuration with the network of the checkpoint that training begins with, where there is one."""
    if not cfg.start:
        return cfg
    known = load_configuration(cfg.start)
    return replace(cfg, **{key: getattr(known, key) for key in NETWORK})


def train_policy(cfg: GraspConfig, inputs: Inputs, out: Path, seed: int) -> Path:
    """Trains Q in the folder `out`, or goes on there, and returns the best checkpoint, which `GraspPolicy` loads.

    The cameras count where Q looks at source pictures, and where the checkpoint is chosen on such. Raises UserError
    where the configuration or the views do not fit, and as `vision_s2r.training.train`.
    """
    cfg = _begun(cfg)
    check(cfg)
    views, validation, sees_sources = inputs.views, inputs.validation, False
    for part, source, names in (
        ("training", views, _read_in_training(cfg)),
        ("validation", validation, _read(cfg, cfg.validate_on)),
    ):
        require(part, source, (*names, *LABELS))
        sees_sources |= any(picture in names for picture in SOURCES)
        if cfg.front and source.size % 2**cfg.front.levels:
            raise UserError(
                f"{part} views of {source.size} px: grasp.front expects a multiple of {2**cfg.front.levels}"
            )
    require_alike(views, validation, sees_sources)
    method = partial(QLearning, cfg, *inputs.cameras, views.size, views.margin)
    return train(method, views, validation, cfg.training, out, seed).best
