"""A policy that learns from another's chances: what the canonical policy would say of the true canonical picture.

The picture is what a translator makes of a randomized scene, or, for domain randomization, the randomized picture
itself. No grasp is simulated, so any grasp can be asked about: random ones, near the teacher's best, and those that the
student itself would choose, where its mistakes are. It is distillation (Hinton et al. 2015, arXiv:1503.02531) on the
student's own actions (Ross et al. 2011, arXiv:1011.0686).
"""

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera import Camera, CameraConfig, sources
from vision_s2r.errors import UserError
from vision_s2r.grasp import augment
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.forms import build, load_q
from vision_s2r.grasp.geometry import random_grasps, wrap
from vision_s2r.grasp.metrics import measure
from vision_s2r.grasp.q_function import QFunction
from vision_s2r.grasp.student_config import StudentConfig, check
from vision_s2r.images import to_float
from vision_s2r.networks import rectification
from vision_s2r.networks.rectifier import POINTS
from vision_s2r.training import (
    Batch,
    Draw,
    Inputs,
    Method,
    Step,
    ViewSource,
    checkpoint,
    muon_and_adamw,
    train,
)
from vision_s2r.training.data import randomized, require, require_alike
from vision_s2r.training.precision import is_mixed

CHUNK = 64  # scenes at a time in validation
FRAMES = ("intrinsics", "extrinsics")
LABELS = ("grasps", "success")
SPREAD = (0.008, 0.008, 0.2)  # m, m, rad: standard deviation around a good grasp
Translator = Callable[[Tensor], Tensor]  # float [B, 3, H, W] in [0, 1] to their canonical views, the same


class Student(Method):
    """Cross-entropy with the teacher's chances as targets."""

    kind = "q_function"
    released = ("q_function",)

    def __init__(
        self,
        cfg: StudentConfig,
        policy: GraspConfig,
        teacher: tuple[QFunction, GraspConfig],
        cameras: tuple[CameraConfig, CameraConfig],
        size: int,
        margin: int,
        translator: Translator | None,
    ):
        """`policy`: of the student, with the checkpoint it starts as; `teacher`: a Q-function of canonical pictures.

        `cameras`: of training and of validation. `size`: side of a picture; `margin`: by which source pictures are
        wider on each side; pixels. Without a `translator` the student looks at source pictures.
        """
        self._cfg, self._policy, self._translator = cfg, policy, translator
        self._teacher = teacher[0].eval().requires_grad_(False)
        self._camera, self._validation_camera = (Camera.from_config(camera) for camera in cameras)
        self._margin, self._size = margin, size
        network = build(policy)
        checkpoint.load(policy.start, self.kind).restore("q_function", network)
        self.fine_tunes = True
        if cfg.training.compile and network.front:
            network.front.compile(dynamic=False)
        self.networks = {"q_function": network}
        self.optimizers = {"q_function": muon_and_adamw(network, cfg.training)}
        known = dict(zip(("camera", "validation_camera"), map(asdict, cameras), strict=True))
        self.configuration = asdict(policy) | known | {"student": asdict(cfg)}
        self.normalization = {"size": size}

    def batch(self, views: ViewSource, draw: Draw) -> Batch:
        batch = {name: views.batch(name, draw.indices) for name in reads(self._policy) if name != "randomized"}
        return batch | {"randomized": randomized(views, draw, self._cfg.shuffle_colours)}

    def training_step(self, batch: Batch, step: Step) -> dict[str, Tensor]:
        pictures, truth = self._seen(batch["randomized"], batch, self._camera, step.generator)
        frames = [batch[name] for name in FRAMES]
        grasps, chances = self._lesson(pictures, to_float(batch["canonical"]), frames, step.generator)
        lesson = dict(zip(FRAMES, frames, strict=True)) | {"images": pictures, "grasps": grasps} | truth
        lesson = augment.turn(lesson, step.generator)
        scores = self.networks["q_function"](*(lesson[k] for k in ("images", *FRAMES, "grasps")))
        losses = {"chances": F.binary_cross_entropy_with_logits(scores.logits.float(), chances)}
        total = losses["chances"]
        if truth:
            losses["rectification"] = rectification.loss(scores.displacements, lesson["displacements"])
            total = total + self._policy.rectification * losses["rectification"]
        step.optimize(total, "q_function")
        return losses

    @torch.no_grad()
    def _lesson(
        self, pictures: Tensor, canonical: Tensor, frames: list[Tensor], generator: torch.Generator
    ) -> tuple[Tensor, Tensor]:
        """Grasps [B, K, 3] to ask about, and the teacher's chances [B, K] for them."""
        cfg, count, area = self._cfg, len(pictures), self._policy.area
        student = self.networks["q_function"]
        candidates = random_grasps(count, cfg.candidates, area, generator).to(pictures)
        with torch.autocast(pictures.device.type, torch.bfloat16, is_mixed(cfg.training, pictures.device)):
            teacher = self._teacher.to(pictures.device)
            known = teacher.encode(canonical, *frames)
            best = _best(candidates, teacher.score(known, candidates), cfg.near_best, area, generator)
            own = _best(candidates, student(pictures, *frames, candidates).logits, cfg.own, area, generator)
            grasps = torch.cat([candidates[:, : cfg.random], best, own], 1)
            return grasps, teacher.score(known, grasps).float().sigmoid()

    @torch.no_grad()
    def _seen(self, source: Tensor, batch: Batch, camera: Camera, generator: torch.Generator) -> tuple[Tensor, Batch]:
        """What the student is given of sources uint8 [B, H+2m, W+2m, 3], and where its own rectifier should look."""
        side = sources.side(source, self._margin)
        parameters = camera.sample(len(source), generator, side, side)
        seen = sources.read(camera, source, parameters, self._margin, batch["intrinsics"], self._size)
        truth = {}
        if self._policy.rectification:
            field = rectification.displacements(batch, parameters, self._size, POINTS)
            truth["displacements"] = field.to(seen.device)
        if self._translator is None:
            return seen, truth
        with torch.autocast(seen.device.type, torch.bfloat16, is_mixed(self._cfg.training, seen.device)):
            return self._translator(seen).float(), truth

    def validate(self, views: ViewSource, generator: torch.Generator) -> dict[str, float]:
        """As `measure`, over the labelled attempts in the validation views, randomized, through the validation camera.

        And chance_difference, the mean absolute difference of the chances from the teacher's.
        """
        logits, success, difference = [], [], []
        for indices in torch.arange(len(views)).split(CHUNK):
            batch = {name: views.batch(name, indices).to(self.device) for name in (*reads(self._policy), *LABELS)}
            frames, grasps = [batch[name] for name in FRAMES], batch["grasps"].float()
            pictures, _ = self._seen(batch["randomized"][:, 0], batch, self._validation_camera, generator)
            found = self.networks["q_function"](pictures, *frames, grasps).logits
            known = self._teacher.to(self.device)(to_float(batch["canonical"]), *frames, grasps).logits
            difference.append((found.sigmoid() - known.sigmoid()).abs().mean(1).cpu())
            logits.append(found.cpu())
            success.append(batch["success"].float().cpu())
        metrics = measure(torch.cat(logits), torch.cat(success))
        return metrics | {"chance_difference": float(torch.cat(difference).mean())}


def _best(grasps: Tensor, values: Tensor, count: int, area: list[float], generator: torch.Generator) -> Tensor:
    """Grasps [B, count, 3] around the highest valued of those given [B, K, 3]."""
    index = values.topk(count, dim=1).indices
    centres = grasps.gather(1, index[..., None].expand(-1, -1, 3))
    noise = torch.randn(centres.shape, generator=generator).to(centres) * centres.new_tensor(SPREAD)
    moved = centres + noise
    half = centres.new_tensor(area)
    return torch.cat([torch.minimum(torch.maximum(moved[..., :2], -half), half), wrap(moved[..., 2:])], -1)


def reads(policy: GraspConfig) -> list[str]:
    """What training a student reads of the views."""
    truth = rectification.SOURCES if policy.rectification else ()
    return list(dict.fromkeys(("randomized", "canonical", *FRAMES, *truth)))


def train_student(
    cfg: StudentConfig,
    inputs: Inputs,
    start: str | Path,
    teacher: str | Path,
    out: Path,
    seed: int,
    translator: Translator | None = None,
) -> Path:
    """Trains a student in the folder `out`, or goes on there, and returns the best checkpoint.

    `start`: the policy that it begins as, unless `cfg.start` names another; `teacher`: the canonical policy. With a
    `translator` the student looks at its pictures, without one at source pictures.
    Raises UserError where the configuration, the checkpoints or the views do not fit, and as
    `vision_s2r.training.train`.
    """
    check(cfg)
    start = cfg.start or start
    _, policy, size = load_q(start)
    q_function, known, _ = load_q(teacher)
    if known.picture != "canonical" or known.with_source:
        raise UserError(f"{teacher}: the teacher looks at source pictures: expected a policy of canonical pictures")
    looks = "canonical" if translator else "randomized"
    if policy.picture != looks or policy.with_source:
        raise UserError(f"{start}: the student begins as a policy of {policy.picture} pictures: expected {looks}")
    for part, source, names in (("training", inputs.views, ()), ("validation", inputs.validation, LABELS)):
        require(part, source, (*reads(policy), *names))
        if source.size != size:
            raise UserError(f"{part} views have {source.size} px: {start} looks at pictures of {size} px")
    require_alike(inputs.views, inputs.validation)
    policy, views = replace(policy, start=str(start)), inputs.views
    method = partial(Student, cfg, policy, (q_function, known), inputs.cameras, views.size, views.margin, translator)
    return train(method, views, inputs.validation, cfg.training, out, seed).best
