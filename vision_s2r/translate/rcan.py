"""RCAN: from any look of a scene to its canonical one, learnt from pairs (James et al. 2019, arXiv:1812.07252)."""

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vision_s2r.camera import Camera, CameraConfig, CameraParameters
from vision_s2r.errors import UserError, nearest
from vision_s2r.images import to_float
from vision_s2r.networks import rectification
from vision_s2r.networks.unet import POINTS, UNet
from vision_s2r.scene import CLASSES
from vision_s2r.training import Batch, Draw, Method, Step, ViewSource, adamw, checkpoint, frozen, train
from vision_s2r.translate import losses, pictures
from vision_s2r.translate.config import LossConfig, TranslateConfig, check
from vision_s2r.translate.discriminator import PatchDiscriminator
from vision_s2r.translate.metrics import overlap, picture_metrics, ratio
from vision_s2r.translate.range_picture import draw
from vision_s2r.translate.widening import Widening

CHUNK = 64  # scenes at a time in validation
DEPTH_SCENES = 512  # from which the range of depth is taken
TARGETS = ("canonical", "segmentation", "depth", "intrinsics")


class Rcan(Method):
    """A U-Net, and with an adversarial weight a patch discriminator that takes turns with it."""

    kind = "translator"
    released = ("unet",)

    def __init__(
        self,
        cfg: TranslateConfig,
        camera: CameraConfig,
        validation_camera: CameraConfig,
        margin: int,
        depth_range: tuple[float, float],
        widening: Widening | None = None,
    ):
        """`margin`: pixels by which source pictures are wider; `depth_range`: nearest and farthest, metres.

        `widening`: whose ranges take the place of the camera's.
        """
        self._widening = widening
        self._cfg, self._margin, self._depth_range = cfg, margin, depth_range
        self._camera, self._validation_camera = (Camera.from_config(c) for c in (camera, validation_camera))
        heads = heads_for(cfg.loss)
        unet = UNet(cfg.network, heads)
        if cfg.start:
            checkpoint.load(cfg.start, self.kind).restore("unet", unet)
        unet.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.networks = {"unet": unet}
        self.optimisers = {"unet": adamw(unet, cfg.training)}
        if cfg.loss.adversarial > 0:
            discriminator = PatchDiscriminator(cfg.discriminator)
            self.networks["discriminator"] = discriminator
            self.optimisers["discriminator"] = adamw(discriminator, cfg.training, cfg.discriminator.learning_rate)
        cameras = {"camera": asdict(camera), "validation_camera": asdict(validation_camera)}
        self.configuration = asdict(cfg) | {"heads": heads} | cameras
        if widening is None:
            del self.configuration["widening"]  # what is off shapes nothing
        self.normalisation = {"depth_range": list(depth_range)}

    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        batch = {name: views.batch(name, draw.indices) for name in needed(self._cfg)}
        randomised = views.batch("randomised", draw.indices)
        which = draw.integers(randomised.shape[1])
        return batch | {"source": randomised[torch.arange(len(which)), which]}

    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        cfg = self._cfg.loss
        if self._widening and self._widening.due(step):
            self._probe(self._widening, step)
        source, target = self._pair(batch, self._camera, self._drawn(batch, step))
        output = self.networks["unet"](source)
        terms = losses.supervised(cfg, output, target)
        if "discriminator" not in self.networks:
            step.optimise(losses.weighted(cfg, terms), "unet")
            return terms
        discriminator, fake = self.networks["discriminator"], output["canonical"]
        with frozen(discriminator):
            terms["adversarial"] = losses.adversarial(cfg.adversarial_form, discriminator(source, fake))
        step.optimise(losses.weighted(cfg, terms), "unet")
        scores = [discriminator(source, picture) for picture in (target["canonical"], fake.detach())]
        terms["discriminator"] = losses.discrimination(cfg.adversarial_form, *scores)
        step.optimise(terms["discriminator"], "discriminator")
        return terms

    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        """Means over the views.

        Of the picture: l1, psnr (dB), ssim, and l1 of its object pixels alone (object_l1); intersection over union
        of the object class (object_iou); absolute errors of depth (depth_error, m) and of the places that the
        rectifier samples (rectification_error, px). And of ranges that widen: width, entropy.
        """
        found: dict[str, list[Tensor]] = {}
        for indices in torch.arange(len(views)).split(CHUNK):
            source, target = self._held_out(views, indices, generator)
            for name, values in self._measure(self.networks["unet"](source), target).items():
                found.setdefault(name, []).append(values.double().cpu())
        sums = {name: torch.cat(values).sum(0) for name, values in found.items()}
        metrics = {name: float(part / whole) for name, (part, whole) in sums.items()}
        if self._widening:
            self._widening.note()
            metrics |= self._widening.metrics()
        return metrics

    def pictures(self, views: ViewSource, generator: torch.Generator) -> dict[str, Tensor]:
        indices = torch.arange(min(self._cfg.pictures, len(views)))
        source, target = self._held_out(views, indices, generator)
        output = self.networks["unet"](source)
        columns = [source, output["canonical"], target["canonical"]]
        if "segmentation" in output:
            classes = (output["segmentation"].argmax(1), target["segmentation"])
            columns += [pictures.coloured(c) for c in classes]
        if "depth" in output:
            columns += [pictures.grey(depth) for depth in (output["depth"], target["depth"])]
        found = {"translation": pictures.grid(columns)}
        return found | ({"ranges": draw(self._widening)} if self._widening else {})

    def state(self) -> dict[str, Any]:
        return self._widening.state() if self._widening else {}

    def restore(self, state: dict[str, Any]) -> None:
        if self._widening:
            self._widening.restore(state)

    def _drawn(self, batch: Batch, step: Step) -> CameraParameters:
        """What the camera does to the pictures of a training step."""
        count, size = batch["canonical"].shape[:2]
        if self._widening:
            return self._widening.sample(step, count, size)
        return self._camera.sample(count, step.generator, size, size)

    @torch.no_grad()
    def _probe(self, widening: Widening, step: Step) -> None:
        """Records what share of its accuracy the translator keeps at the ranges' boundaries, on held-out views."""
        scenes, parameters, boundary = widening.probe(step)
        batch = self._read(widening.views, scenes)
        clean = self._errors(batch, CameraParameters.of({}, len(scenes)))
        widening.ranges.record(boundary, (clean / self._errors(batch, parameters)).double().cpu().numpy())

    def _errors(self, batch: Batch, parameters: CameraParameters) -> Tensor:
        """Absolute error [B] of the canonical pictures, in which objects count as in the loss."""
        source, target = self._pair(batch, self._camera, parameters)
        error = (self.networks["unet"](source)["canonical"] - target["canonical"]).abs()
        return (losses.weights(self._cfg.loss, target) * error).mean((1, 2, 3))

    def _pair(self, batch: Batch, camera: Camera, parameters: CameraParameters) -> tuple[Tensor, Batch]:
        """The batch's source pictures as a camera sees them, float [B, 3, H, W] in [0, 1] without margin; targets."""
        images = to_float(batch["source"])
        size = batch["canonical"].shape[1]
        target = self._target(batch)
        if rectifies(self._cfg):
            truth = rectification.displacements(batch, parameters, size, POINTS)
            target["displacements"] = truth.to(images.device)
        return camera(images, parameters, self._margin, batch["intrinsics"]), target

    def _target(self, batch: Batch) -> Batch:
        near, far = self._depth_range
        return {
            "canonical": to_float(batch["canonical"]),
            "segmentation": batch["segmentation"].long(),
            "depth": ((batch["depth"] - near) / (far - near)).unsqueeze(1),
        }

    def _held_out(self, views: ViewSource, indices: Tensor, generator: torch.Generator) -> tuple[Tensor, Batch]:
        """Pictures through the validation camera, and their targets."""
        camera = self._validation_camera
        return self._pair(
            self._read(views, indices), camera, camera.sample(len(indices), generator, views.size, views.size)
        )

    def _read(self, views: ViewSource, indices: Tensor) -> Batch:
        """Held-out views of the look that the validation camera has, on the device."""
        batch = {name: views.batch(name, indices) for name in needed(self._cfg)}
        held_out = views.batch(self._cfg.validate_on, indices)
        batch["source"] = held_out[:, 0] if self._cfg.validate_on == "randomised" else held_out
        return {name: tensor.to(self.device) for name, tensor in batch.items()}

    def _measure(self, output: Batch, target: Batch) -> Batch:
        """Each metric as [B, 2], numerator and denominator of the mean over all samples."""
        canonical = output["canonical"].clamp(0, 1)
        mask = target["segmentation"] == losses.OBJECT
        found = picture_metrics(canonical, target["canonical"], mask)
        if "segmentation" in output:
            found["object_iou"] = overlap(output["segmentation"].argmax(1) == losses.OBJECT, mask)
        if "displacements" in target:
            off = rectification.error(output["displacements"], target["displacements"], canonical.shape[-1])
            found["rectification_error"] = ratio(off)
        if "depth" in output:
            near, far = self._depth_range
            found["depth_error"] = ratio((far - near) * (output["depth"] - target["depth"]).abs().mean((1, 2, 3)))
        return found


def rectifies(cfg: TranslateConfig) -> bool:
    """Whether there is a rectifier that is told where to look."""
    return cfg.network.rectifier > 0 and cfg.loss.rectification > 0


def needed(cfg: TranslateConfig) -> tuple[str, ...]:
    """The tensors of the views that training reads, but for the source pictures."""
    return tuple(dict.fromkeys((*TARGETS, *rectification.SOURCES))) if rectifies(cfg) else TARGETS


def heads_for(cfg: LossConfig) -> dict[str, int]:
    """Maps that a network trained with these losses has, and their channels."""
    heads = {"canonical": 3}
    if cfg.segmentation > 0:
        heads["segmentation"] = len(CLASSES)
    if cfg.depth > 0:
        heads["depth"] = 1
    return heads


def train_translator(
    views: ViewSource,
    validation: ViewSource,
    cfg: TranslateConfig,
    camera: CameraConfig,
    validation_camera: CameraConfig,
    out: Path,
    seed: int,
) -> Path:
    """Trains RCAN in the folder `out`, or goes on there, and returns the best checkpoint.

    `camera` is drawn from during training, `validation_camera` chooses the checkpoint. Raises UserError where the
    configuration or the views do not fit, and as `vision_s2r.training.train`.
    """
    check(cfg)
    stride = 2**cfg.network.levels
    for part, source in (("training", views), ("validation", validation)):
        if source.size % stride:
            raise UserError(f"{part} views of {source.size} px: expected a multiple of {stride}, as the network halves")
        picture = "randomised" if part == "training" else cfg.validate_on
        for name in (picture, *needed(cfg)):
            if name not in source.names:
                raise UserError(f"{part} views hold no '{name}': {nearest(name, source.names)}")
    if views.margin != validation.margin:
        raise UserError(f"views have margins of {views.margin} and {validation.margin} px: expected the same")
    widening = (
        Widening(cfg.widening, Camera.from_config(camera), validation, seed, out) if cfg.widening.limits else None
    )
    method = partial(Rcan, cfg, camera, validation_camera, views.margin, depth_range(views), widening)
    return train(method, views, validation, cfg.training, out, seed).best


def depth_range(views: ViewSource) -> tuple[float, float]:
    """Nearest and farthest depth (m) in the first scenes of the views."""
    depth = views.batch("depth", torch.arange(min(DEPTH_SCENES, len(views))))
    near, far = float(depth.min()), float(depth.max())
    if not near < far:
        raise UserError(f"training views are {near} m deep everywhere: expected scenes with depth")
    return near, far
