"""What the rows train: translators under cameras, policies on grasps that were tried again on the robot believed in."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from vision_s2r import parallel
from vision_s2r.camera import CameraConfig
from vision_s2r.close_gap.config import CloseGapStudyConfig
from vision_s2r.grasp import train_policy
from vision_s2r.pipeline import frozen_q, labelled, pairs
from vision_s2r.render import Views
from vision_s2r.scene import attempt
from vision_s2r.scene.drives import Tuning
from vision_s2r.scene.machine import Machine
from vision_s2r.training import TrainingConfig, ViewSource
from vision_s2r.translate import train_translator

GRASPS = "grasps.npz"
CHOOSING = 0.2  # of the grasps, those that choose the checkpoint


def as_it_came(cfg: CloseGapStudyConfig, out: Path) -> Path:
    """A translator from scratch, whose camera is perfect: the simulator knows of no effects."""
    came = cfg.close_gap
    rates = replace(cfg.translate.training, learning_rate=came.came_learning_rate, muon=came.came_muon)
    return _translator(cfg, CameraConfig(), "", came.came_steps, rates, out)


def translator(cfg: CloseGapStudyConfig, camera: CameraConfig, start: Path | str, out: Path) -> Path:
    """The translator after some steps under this camera, which also chooses the checkpoint."""
    settings = cfg.close_gap
    rates = replace(cfg.translate.training, learning_rate=settings.learning_rate)
    return _translator(cfg, camera, str(start), settings.steps, rates, out)


def _translator(
    cfg: CloseGapStudyConfig, camera: CameraConfig, start: str, steps: int, training: TrainingConfig, out: Path
) -> Path:
    training = replace(training, max_steps=steps, max_minutes=0.0, validate_every=max(steps // 2, 1))
    translate = replace(cfg.translate, start=start, training=training)
    inputs = replace(pairs(cfg), camera=camera, validation_camera=camera)
    return train_translator(translate, inputs, out, cfg.seed, frozen_q(translate))


def policy(cfg: CloseGapStudyConfig, robots: Sequence[Machine], tuning: Tuning, out: Path) -> Path | str:
    """The policy after some steps on grasps whose outcomes are those on these robots, by turns.

    Others of these grasps choose the checkpoint. Without any the policy stays as it came.
    """
    settings = cfg.close_gap
    if not settings.grasps:
        return settings.policy
    out = out / f"{settings.grasps}_grasps"
    training = replace(
        cfg.grasp.training,
        max_steps=settings.policy_steps,
        max_minutes=0.0,
        learning_rate=settings.policy_learning_rate,
        validate_every=max(settings.policy_steps // 2, 1),
    )
    inputs, chosen_by = labelled(cfg), round(CHOOSING * settings.grasps)
    views = tried_again(cfg, inputs.views, settings.grasps - chosen_by, robots, tuning, out)
    validation = tried_again(cfg, inputs.validation, chosen_by, robots, tuning, out / "validation")
    grasp = replace(cfg.grasp, start=settings.policy, training=training)
    return train_policy(grasp, replace(inputs, views=views, validation=validation), out, cfg.seed)


class Again:
    """Views whose grasps have other outcomes (a source of views for training)."""

    def __init__(self, views: Views, success: Tensor) -> None:
        """`success`: as the views' own, [N, grasps]."""
        self._views, self._success = views, success
        self.size, self.source_size = views.size, views.source_size
        self.margin, self.names = views.margin, views.names

    def __len__(self) -> int:
        return len(self._views)

    def batch(self, name: str, indices: Tensor) -> Tensor:
        """Rows `indices` [B] of a tensor, [B, ...]."""
        return self._success[indices] if name == "success" else self._views.batch(name, indices)


def tried_again(
    cfg: CloseGapStudyConfig, views: ViewSource, count: int, robots: Sequence[Machine], tuning: Tuning, out: Path
) -> Again:
    """The first views, with outcomes of some `count` grasps on these robots, by turns; kept in `out`, tried once."""
    assert isinstance(views, Views)
    scenes = max(ceil(count / int(views.manifest.render["grasps"])), 1)
    views = views.subset(range(min(len(views), scenes)))
    path = out / GRASPS
    if not path.exists():
        grasps, states = views.all("grasps").numpy().astype(float), views.states()
        jobs = [(i, j) for i in range(len(states)) for j in range(grasps.shape[1])]
        calls = ((cfg.scene, states[i], grasps[i, j], robots[k % len(robots)], tuning) for k, (i, j) in enumerate(jobs))
        held = [outcome.success for outcome in parallel.run(attempt, calls, cfg.jobs, cfg.backend)]
        out.mkdir(parents=True, exist_ok=True)
        partial = path.with_suffix(".partial.npz")
        np.savez(partial, success=np.array(held).reshape(grasps.shape[:2]))
        partial.rename(path)
    with np.load(path, allow_pickle=False) as content:
        return Again(views, torch.from_numpy(content["success"]).to(views.all("success").dtype))
