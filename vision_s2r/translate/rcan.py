"""RCAN: from any look of a scene to its canonical one, learnt from pairs (James et al. 2019, arXiv:1812.07252)."""

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vision_s2r.camera import Camera, CameraConfig, CameraParameters, sources
from vision_s2r.errors import UserError
from vision_s2r.networks import rectification
from vision_s2r.networks.unet import UNet
from vision_s2r.scene import CLASSES, palette
from vision_s2r.training import (
    Batch,
    Draw,
    Inputs,
    Method,
    Step,
    ViewSource,
    adamw,
    checkpoint,
    frozen,
    muon_and_adamw,
    train,
)
from vision_s2r.training.data import require, require_alike
from vision_s2r.translate import losses, perceptual, pictures
from vision_s2r.translate.adr import CameraAdr
from vision_s2r.translate.config import LossConfig, TranslateConfig, check
from vision_s2r.translate.discriminator import PatchDiscriminator
from vision_s2r.translate.metrics import objects, overlap, picture_metrics, ratio
from vision_s2r.translate.pairs import LABELS, Pairs, needed
from vision_s2r.translate.perceptual import QFeatures, Vgg
from vision_s2r.translate.translator import network_of

CHUNK = 64  # scenes at a time in validation
DEPTH_SCENES = 512  # from which the range of depth is taken


class Rcan(Method):
    """A U-Net, and with an adversarial weight a patch discriminator that takes turns with it."""

    kind = "translator"
    released = ("unet",)

    def __init__(
        self,
        cfg: TranslateConfig,
        camera: CameraConfig,
        validation_camera: CameraConfig,
        views: ViewSource,
        adr: CameraAdr | None = None,
        frozen_q: QFeatures | None = None,
    ):
        """`views`: to be trained on; their size, margin and range of depth are kept.

        `adr`: whose ranges take the place of the camera's. `frozen_q`: a frozen policy that validation asks, and the
        perceptual loss.
        """
        self._adr, self._frozen_q = adr, frozen_q
        self._vgg = Vgg() if cfg.loss.vgg > 0 else None
        self._cfg, self._depth_range, self._margin = cfg, depth_range(views), views.margin
        self._pairs = Pairs(cfg, views.margin, self._depth_range, labelled=frozen_q is not None)
        self._camera, self._validation_camera = (Camera.from_config(c) for c in (camera, validation_camera))
        heads = heads_for(cfg.loss)
        unet = UNet(cfg.network, heads)
        if cfg.start:
            checkpoint.load(cfg.start, self.kind).restore("unet", unet)
        self.fine_tunes = bool(cfg.start)
        unet.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        if cfg.training.compile:
            unet.compile(dynamic=False)
        self.networks = {"unet": unet}
        self.optimizers: dict[str, torch.optim.Optimizer] = {"unet": muon_and_adamw(unet, cfg.training)}
        if cfg.loss.adversarial > 0:
            discriminator = PatchDiscriminator(cfg.discriminator)
            self.networks["discriminator"] = discriminator
            self.optimizers["discriminator"] = adamw(discriminator, cfg.training, cfg.discriminator.learning_rate)
        cameras = {"camera": asdict(camera), "validation_camera": asdict(validation_camera)}
        self.configuration = _configuration(cfg) | {"heads": heads} | cameras
        self.normalization = normalization(views.size, self._depth_range)

    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        return self._pairs.drawn(views, draw)

    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        cfg = self._cfg.loss
        if self._adr and self._adr.due(step):
            self._probe(self._adr, step)
        source, target = self._pairs(batch, self._camera, self._drawn(batch, step))
        output = self.networks["unet"](source)
        terms = losses.supervised(cfg, output, target) | self._perceived(output, target, step)
        if "discriminator" not in self.networks:
            step.optimize(losses.weighted(cfg, terms), "unet")
            return terms
        discriminator, fake = self.networks["discriminator"], output["canonical"]
        with frozen(discriminator):
            terms["adversarial"] = losses.adversarial(cfg.adversarial_form, discriminator(source, fake))
        step.optimize(losses.weighted(cfg, terms), "unet")
        scores = [discriminator(source, picture) for picture in (target["canonical"], fake.detach())]
        terms["discriminator"] = losses.discrimination(cfg.adversarial_form, *scores)
        step.optimize(terms["discriminator"], "discriminator")
        return terms

    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        """Means over the views.

        Of the picture: l1, psnr (dB), ssim, and l1 of its object pixels alone (object_l1); intersection over union
        of the object class (object_iou); absolute errors of depth (depth_error, m) and of the places that the
        rectifier samples (rectification_error, px). Of a frozen Q: q_difference, auc, as it says. Of automatic
        randomization: width, entropy.
        """
        found: dict[str, list[Tensor]] = {}
        scores: list[Tensor] = []
        for indices in torch.arange(len(views)).split(CHUNK):
            source, target = self.held_out(views, indices, generator)
            output = self.networks["unet"](source)
            for name, values in self._measure(output, target).items():
                found.setdefault(name, []).append(values.double().cpu())
            if self._frozen_q:
                scores.append(perceptual.scores(self._frozen_q, output["canonical"].clamp(0, 1), target).cpu())
        sums = {name: torch.cat(values).sum(0) for name, values in found.items()}
        metrics = {name: float(part / whole) for name, (part, whole) in sums.items()}
        if self._frozen_q:
            metrics |= self._frozen_q.measure(*torch.cat(scores).unbind(-1))
        if self._adr:
            self._adr.note()
            metrics |= self._adr.metrics()
        return metrics

    def pictures(self, views: ViewSource, generator: torch.Generator) -> dict[str, Tensor]:
        indices = torch.arange(min(self._cfg.pictures, len(views)))
        source, target = self.held_out(views, indices, generator)
        output = self.networks["unet"](source)
        columns = [source, output["canonical"], target["canonical"]]
        if "segmentation" in output:
            classes = (output["segmentation"].argmax(1), target["segmentation"])
            columns += [pictures.coloured(c) for c in classes]
        if "depth" in output:
            columns += [pictures.grey(depth) for depth in (output["depth"], target["depth"])]
        found = {"translation": pictures.grid(columns)}
        if self._adr:
            from vision_s2r.translate.range_picture import draw  # matplotlib takes half a second to import

            found["ranges"] = draw(self._adr)
        return found

    def held_out(self, views: ViewSource, indices: Tensor, generator: torch.Generator) -> tuple[Tensor, Batch]:
        """Pictures through the validation camera, float [B, 3, H, W] in [0, 1], and their targets, on the device."""
        camera, size = self._validation_camera, views.source_size
        return self._pairs(self._read(views, indices), camera, camera.sample(len(indices), generator, size, size))

    def state(self) -> dict[str, Any]:
        return self._adr.state() if self._adr else {}

    def restore(self, state: dict[str, Any]) -> None:
        if self._adr:
            self._adr.restore(state)

    def _perceived(self, output: Batch, target: Batch, step: Step) -> dict[str, Tensor]:
        """The terms that compare the pictures as frozen networks see them, without their weights."""
        found, pictures = {}, (output["canonical"], target["canonical"])
        if self._frozen_q and self._cfg.loss.perceptual > 0:
            whole, rows = step.rows(len(pictures[0]))
            grasps = self._frozen_q.grasps(whole, step.shared)[rows].to(self.device)
            where = target["intrinsics"], target["extrinsics"], grasps
            found["perceptual"] = losses.perceptual(*(self._frozen_q.activations(each, *where) for each in pictures))
        if self._vgg:
            found["vgg"] = losses.perceptual(*map(self._vgg, pictures))
        return found

    def _drawn(self, batch: Batch, step: Step) -> CameraParameters:
        """What the camera does to the pictures of a training step."""
        size = sources.side(batch["source"], self._margin)
        whole, rows = step.rows(len(batch["source"]))
        if self._adr:
            return self._adr.sample(step, whole, size).select(rows)
        return self._camera.sample(whole, step.shared, size, size).select(rows)

    @torch.no_grad()
    def _probe(self, adr: CameraAdr, step: Step) -> None:
        """Records what share of its accuracy the translator keeps at the ranges' boundaries, on held-out views."""
        scenes, parameters, boundary = adr.probe(step)
        batch = self._read(adr.views, scenes)
        clean = self._errors(batch, CameraParameters.of({}, len(scenes)))
        adr.ranges.record(boundary, (clean / self._errors(batch, parameters)).double().cpu().numpy())

    def _errors(self, batch: Batch, parameters: CameraParameters) -> Tensor:
        """Absolute error [B] of the canonical pictures, in which objects count as in the loss."""
        source, target = self._pairs(batch, self._camera, parameters)
        error = (self.networks["unet"](source)["canonical"] - target["canonical"]).abs()
        return (losses.weights(self._cfg.loss, target) * error).mean((1, 2, 3))

    def _read(self, views: ViewSource, indices: Tensor) -> Batch:
        """Held-out views of the look that the validation camera has, on the device."""
        batch = self._pairs.held_out(views, indices, self._cfg.validate_on)
        return {name: tensor.to(self.device) for name, tensor in batch.items()}

    def _measure(self, output: Batch, target: Batch) -> Batch:
        """Each metric as [B, 2], numerator and denominator of the mean over all samples."""
        canonical = output["canonical"].clamp(0, 1)
        mask = target["segmentation"] == losses.OBJECT
        found = picture_metrics(canonical, target["canonical"], mask)
        found["object_iou"] = overlap(objects(output, canonical), mask)
        if "displacements" in target:
            off = rectification.error(output["displacements"], target["displacements"], canonical.shape[-1])
            found["rectification_error"] = ratio(off)
        if "depth" in output:
            near, far = self._depth_range
            found["depth_error"] = ratio((far - near) * (output["depth"] - target["depth"]).abs().mean((1, 2, 3)))
        return found


def heads_for(cfg: LossConfig) -> dict[str, int]:
    """Maps that a network trained with these losses has, and their channels."""
    heads = {"canonical": 3}
    if cfg.segmentation > 0:
        heads["segmentation"] = len(CLASSES)
    if cfg.depth > 0:
        heads["depth"] = 1
    return heads


def train_translator(
    cfg: TranslateConfig, inputs: Inputs, out: Path, seed: int, frozen_q: QFeatures | None = None
) -> Path:
    """Trains RCAN in the folder `out`, or goes on there, and returns the best checkpoint.

    `frozen_q`: the policy that `cfg.q_function` names. Raises UserError where the configuration or the views do not
    fit, and as `vision_s2r.training.train`.
    """
    if cfg.start:
        cfg = replace(cfg, network=network_of(cfg.start))
    check(cfg)
    views, validation = inputs.views, inputs.validation
    if frozen_q and frozen_q.size != views.size:
        raise UserError(f"{cfg.q_function} judges pictures of {frozen_q.size} px: the views have {views.size} px")
    check_views(cfg, views, validation, labelled=frozen_q is not None)
    adr = CameraAdr(cfg.adr, Camera.from_config(inputs.camera), validation, seed, out) if cfg.adr.limits else None
    method = partial(Rcan, cfg, *inputs.cameras, views, adr, frozen_q)
    return train(method, views, validation, cfg.training, out, seed).best


def check_views(cfg: TranslateConfig, views: ViewSource, validation: ViewSource, labelled: bool = False) -> None:
    """Raises UserError where views to train and to validate on do not fit the configuration or each other.

    `labelled`: whether a policy judges the pictures, and wants labels.
    """
    stride = 2**cfg.network.levels
    for part, source in (("training", views), ("validation", validation)):
        if source.size % stride:
            raise UserError(f"{part} views of {source.size} px: expected a multiple of {stride}, as the network halves")
        picture = "randomized" if part == "training" else cfg.validate_on
        labels = LABELS if labelled and part == "validation" else ()
        require(part, source, (picture, *needed(cfg, labelled), *labels))
    require_alike(views, validation)


def depth_range(views: ViewSource) -> tuple[float, float]:
    """Nearest and farthest depth (m) in the first scenes of the views."""
    depth = views.batch("depth", torch.arange(min(DEPTH_SCENES, len(views))))
    near, far = float(depth.min()), float(depth.max())
    if not near < far:
        raise UserError(f"training views are {near} m deep everywhere: expected scenes with depth")
    return near, far


def normalization(size: int, depth_range: tuple[float, float]) -> dict[str, Any]:
    """What a translator's checkpoint says of its pictures: side (px), nearest and farthest depth (m), colours."""
    return {"size": size, "depth_range": list(depth_range), "palette": [list(colour) for colour in palette()]}


def _configuration(cfg: TranslateConfig) -> dict[str, Any]:
    """What shapes a run: all but what is off."""
    found = asdict(cfg)
    if not cfg.adr.limits:
        del found["adr"]
    if not cfg.q_function:
        del found["q_function"]
    for name in ("perceptual", "vgg"):
        if not found["loss"][name]:
            del found["loss"][name]
    return found
