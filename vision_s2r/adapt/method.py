"""Generators between two looks, discriminators, and a Q-function for each, trained together.

RL-CycleGAN (Rao et al. 2020, arXiv:2006.09001) has all of it. Without the RL-scene consistency loss it is CycleGAN
(Zhu et al. 2017, arXiv:1703.10593), its Q a bystander. Without the way back, with a head that keeps the classes, and
Q's loss for the generator to feel, it is like GraspGAN (Bousmalis et al. 2018, arXiv:1709.07857).
"""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from vision_s2r.adapt import losses
from vision_s2r.adapt.config import AdaptConfig
from vision_s2r.adapt.networks import generators, policies, q_functions, to_canonical
from vision_s2r.camera import Camera, CameraConfig, sources
from vision_s2r.grasp import augment, negatives
from vision_s2r.grasp.geometry import random_grasps
from vision_s2r.grasp.metrics import measure
from vision_s2r.images import to_float
from vision_s2r.render.seen import Recorded
from vision_s2r.training import Batch, Draw, Method, Step, ViewSource, adamw, frozen
from vision_s2r.translate import pictures
from vision_s2r.translate.config import TranslateConfig
from vision_s2r.translate.discriminator import PatchDiscriminator
from vision_s2r.translate.losses import OBJECT, adversarial, discrimination, supervised, weighted
from vision_s2r.translate.metrics import picture_metrics, ratio
from vision_s2r.translate.pairs import Pairs
from vision_s2r.translate.rcan import normalization

CHUNK = 64  # scenes at a time in validation
FRAMES = ("intrinsics", "extrinsics")
LABELS = (*FRAMES, "grasps", "success")
KIND = "adaptation"
DISCRIMINATORS = {"to_real": "real_discriminator", "to_canonical": "canonical_discriminator"}  # of generators


class Adaptation(Method):
    """Networks `to_real` and `to_canonical`, a discriminator and a Q-function of each look."""

    kind = KIND

    def __init__(
        self,
        cfg: AdaptConfig,
        translate: TranslateConfig,
        recorded: Recorded,
        cameras: tuple[CameraConfig, CameraConfig],
        margin: int,
        depth_range: tuple[float, float],
    ):
        """`recorded`: real pictures to learn the look from; `cameras`: of training's pairs and of validation.

        `translate`: how pairs are learnt; `margin` (pixels) and `depth_range` (m) as in `vision_s2r.translate.rcan`.
        """
        self._cfg, self._recorded, self._margin = cfg, recorded, margin
        self._translate_cfg = translate
        self._pairs = Pairs(translate, margin, depth_range)
        self._training_camera, self._camera = (Camera.from_config(camera) for camera in cameras)
        self._policy = policies(cfg)
        self.networks = generators(cfg, translate)
        if cfg.loss.adversarial > 0:
            for generator, discriminator in DISCRIMINATORS.items():
                if generator in self.networks:
                    self.networks[discriminator] = PatchDiscriminator(cfg.discriminator, pictures=1)
        self.networks |= q_functions(cfg)
        self.optimizers = {name: self._optimizer(name, network) for name, network in self.networks.items()}
        self.networks["policy"] = deepcopy(self.networks["q_canonical"])  # what translations are for; it stays
        self._players = tuple(name for name in self.optimizers if name not in DISCRIMINATORS.values())
        self.released = tuple(name for name in self._players if name != "q_canonical")
        known = dict(zip(("camera", "validation_camera"), map(asdict, cameras), strict=True))
        pairs = {"translate": asdict(translate)} if cfg.loss.paired > 0 else {}
        network, heads = to_canonical(cfg, translate)
        shape = {"network": asdict(network), "heads": heads} if cfg.way_back else {}
        self.configuration = {"adapt": asdict(cfg), "policy": asdict(self._policy["q_real"])} | pairs | known | shape
        self.normalization = normalization(recorded.size, depth_range)

    def _optimizer(self, name: str, network: nn.Module) -> torch.optim.AdamW:
        cfg = self._cfg
        if name.startswith("q_"):
            return adamw(network, cfg.training, cfg.q_learning_rate)
        rate = cfg.discriminator.learning_rate if name in DISCRIMINATORS.values() else cfg.training.learning_rate
        return adamw(network, cfg.training, rate, momentum=0.5)

    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        batch = {name: views.batch(name, draw.indices) for name in ("canonical", "segmentation", *LABELS)}
        if self._cfg.loss.paired > 0:
            batch |= self._pairs.drawn(views, draw)
        other = draw.integers(len(self._recorded))
        batch |= {f"seen_{name}": self._recorded.batch(name, other) for name in FRAMES}
        return batch | {"seen": self._recorded.batch("seen", other)}

    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        cfg, networks = self._cfg.loss, self.networks
        x, y = to_float(batch["canonical"]), to_float(batch["seen"])
        made = self._translate(x, y)
        with frozen(*(networks[name] for name in DISCRIMINATORS.values() if name in networks)):
            terms = self._appearance(x, y, made)
        if cfg.segmentation > 0:
            terms["segmentation"] = F.cross_entropy(made["segmentation"], batch["segmentation"].long())
        if cfg.paired > 0:
            terms["paired"] = self._paired(batch, step)
        terms |= self._values(batch, x, y, made, step)
        step.optimize(self._weighted(terms), *self._players)
        for name, truth, fake in (("real_discriminator", y, "x_real"), ("canonical_discriminator", x, "y_canonical")):
            if name in networks:
                scores = (networks[name](picture) for picture in (truth, made[fake].detach()))
                terms[name] = discrimination(cfg.adversarial_form, *scores)
                step.optimize(terms[name], name)
        return terms

    def _translate(self, x: Tensor, y: Tensor) -> Batch:
        """x as real (x_real) and back (x_back), y as canonical (y_canonical) and back; the classes found in x."""
        maps = self.networks["to_real"](x)
        made = {"x_real": maps["picture"]} | {k: v for k, v in maps.items() if k == "segmentation"}
        if "to_canonical" in self.networks:
            made["x_back"] = self._canonical(made["x_real"])
            made["y_canonical"] = self._canonical(y)
            made["y_back"] = self.networks["to_real"](made["y_canonical"])["picture"]
        return made

    def _canonical(self, real: Tensor) -> Tensor:
        picture: Tensor = self.networks["to_canonical"](real)["canonical"]
        return picture

    def _appearance(self, x: Tensor, y: Tensor, made: Batch) -> Batch:
        """The terms that look at pictures."""
        cfg, networks = self._cfg.loss, self.networks
        terms = {}
        if cfg.adversarial > 0:
            terms["adversarial"] = adversarial(cfg.adversarial_form, networks["real_discriminator"](made["x_real"]))
            if "y_canonical" in made:
                fooled = networks["canonical_discriminator"](made["y_canonical"])
                terms["adversarial"] = terms["adversarial"] + adversarial(cfg.adversarial_form, fooled)
        if cfg.cycle > 0:
            terms["cycle"] = losses.cycle(x, made["x_back"]) + losses.cycle(y, made["y_back"])
        if cfg.identity > 0:
            terms["identity"] = losses.cycle(y, networks["to_real"](y)["picture"])
            if "to_canonical" in networks:
                terms["identity"] = terms["identity"] + losses.cycle(x, self._canonical(x))
        return terms

    def _paired(self, batch: Batch, step: Step) -> Tensor:
        """The translator's own loss, on randomized pictures of the scenes through the training camera."""
        side = sources.side(batch["source"], self._margin)
        parameters = self._training_camera.sample(len(batch["source"]), step.generator, side, side)
        source, target = self._pairs(batch, self._training_camera, parameters)
        loss = self._translate_cfg.loss
        return weighted(loss, supervised(loss, self.networks["to_canonical"](source), target))

    def _values(self, batch: Batch, x: Tensor, y: Tensor, made: Batch, step: Step) -> Batch:
        """Q's own loss on the labelled scenes, in all three looks, and how far it changes with the look."""
        cfg, area = self._cfg, self._policy["q_real"].area
        labelled = batch | {"success": batch["success"].float(), "grasps": batch["grasps"].float()}
        labelled["weight"] = torch.ones_like(labelled["success"])
        if cfg.negatives:
            labelled = negatives.add(labelled, cfg.negatives, area, step.generator)
        feels = cfg.loss.task > 0 or cfg.loss.rl_scene > 0
        chain = [x, *(made[name] for name in ("x_real", "x_back") if name in made)]
        of_x = self._triple(labelled, chain if feels else [each.detach() for each in chain], step)
        errors = [
            F.binary_cross_entropy_with_logits(logits.float(), labelled["success"], labelled["weight"])
            for logits in of_x
        ]
        terms = {"task": torch.stack(errors).sum()}
        if cfg.loss.rl_scene > 0:
            random = random_grasps(len(y), cfg.grasps, area, step.generator)
            unlabelled = {"grasps": random.to(y.device)} | {name: batch[f"seen_{name}"] for name in FRAMES}
            of_y = self._triple(unlabelled, [y, made["y_canonical"], made["y_back"]], step, real_first=True)
            terms["rl_scene"] = losses.scene_consistency([_three(of_x), _three(of_y)])
        return terms

    def _triple(self, batch: Batch, chain: list[Tensor], step: Step, real_first: bool = False) -> list[Tensor]:
        """Logits [B, K] of the same grasps in pictures of alternating look, degraded as those a policy learns on."""
        names = ("q_real", "q_canonical") if real_first else ("q_canonical", "q_real")
        augmentation = self._policy["q_real"].augmentation
        return [
            self._q(names[k % 2], batch, augment.degrade(picture, augmentation, step.generator))
            for k, picture in enumerate(chain)
        ]

    def _q(self, name: str, batch: Mapping[str, Tensor], picture: Tensor) -> Tensor:
        found: Tensor = self.networks[name](picture, *(batch[key] for key in LABELS[:3])).logits
        return found

    def _weighted(self, terms: Batch) -> Tensor:
        """The sum of the terms, each times its weight; Q's own loss counts in full for Q."""
        weights = asdict(self._cfg.loss) | {"task": self._cfg.loss.task or 1.0}
        total: Any = sum(weights[name] * term for name, term in terms.items())
        return total

    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        """Over the validation views, real pictures through the validation camera.

        `auc_real`: as `grasp.metrics.measure`, of the Q of real pictures; `auc`, of the canonical policy on translated
        ones; `auc_mean`: their mean. `q_difference`: absolute difference of the policy's chances on them and on true
        canonical ones. l1, psnr, ssim, object_l1 of translated pictures: as `translate.metrics.picture_metrics`.
        """
        found: dict[str, list[Tensor]] = {}
        for indices in torch.arange(len(views)).split(CHUNK):
            for name, values in self._measure(views, indices, generator).items():
                found.setdefault(name, []).append(values.float().cpu())
        whole = {name: torch.cat(parts) for name, parts in found.items()}
        success = whole.pop("success")
        aucs = {name: measure(whole.pop(name), success)["auc"] for name in ("auc_real", "auc") if name in whole}
        means = {name: float(part / count) for name, (part, count) in ((k, v.sum(0)) for k, v in whole.items())}
        return {"auc_mean": sum(aucs.values()) / len(aucs)} | aucs | means

    def _measure(self, views: ViewSource, indices: Tensor, generator: torch.Generator) -> Batch:
        batch = {name: views.batch(name, indices).to(self.device) for name in ("canonical", *LABELS)}
        y, canonical = self._held_out(views, indices, generator), to_float(batch["canonical"])
        batch |= {"grasps": batch["grasps"].float()}
        found = {"success": batch["success"].float(), "auc_real": self._q("q_real", batch, y)}
        if "to_canonical" in self.networks:
            translated = self._canonical(y).clamp(0, 1)
            found["auc"] = self._q("policy", batch, translated)
            truth = self._q("policy", batch, canonical).sigmoid()
            found["q_difference"] = ratio((found["auc"].sigmoid() - truth).abs().mean(1))
            objects = views.batch("segmentation", indices).to(self.device) == OBJECT
            found |= picture_metrics(translated, canonical, objects)
        return found

    def _held_out(self, views: ViewSource, indices: Tensor, generator: torch.Generator) -> Tensor:
        """Real pictures of validation views through the validation camera, float [B, 3, H, W] in [0, 1]."""
        real, frame = (views.batch(name, indices).to(self.device) for name in ("real", "intrinsics"))
        parameters = self._camera.sample(len(real), generator, views.source_size, views.source_size)
        return sources.read(self._camera, real, parameters, views.margin, frame, views.size)

    def pictures(self, views: ViewSource, generator: torch.Generator) -> dict[str, Tensor]:
        indices = torch.arange(min(self._cfg.pictures, len(views)))
        x = to_float(views.batch("canonical", indices).to(self.device))
        y = self._held_out(views, indices, generator)
        made = self._translate(x, y)
        shown = [x, made["x_real"], made.get("x_back"), y, made.get("y_canonical"), made.get("y_back")]
        return {"translation": pictures.grid([each for each in shown if each is not None])}


def _three(logits: list[Tensor]) -> losses.Triple:
    first, second, third = logits
    return first, second, third
