"""Which form of Q is best on the same data in the same time."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch

from vision_s2r.errors import UserError
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.forms import build
from vision_s2r.grasp.method import train_policy
from vision_s2r.grasp.policy import GraspPolicy
from vision_s2r.training import Inputs, ViewSource, checkpoint

Attempt = Callable[[int, np.ndarray], bool]  # index of a validation scene, grasp float64 [3] → success


@dataclass(frozen=True)
class FormResult:
    """What became of one form."""

    parameters: int
    steps: int  # of training, up to its best checkpoint
    metrics: dict[str, float]  # of the best checkpoint, on the attempts of the validation scenes
    successes: int  # of the grasps that the policy chose, one in each of `scenes`
    scenes: int
    milliseconds: float  # of the policy, a scene


def compare_forms(
    forms: dict[str, GraspConfig],
    views: ViewSource,
    validation: ViewSource,
    attempt: Attempt,
    minutes: float,
    out: Path,
    seed: int,
) -> dict[str, FormResult]:
    """Trains each of `forms` (by name) for `minutes` of wall clock in a folder of `out`, and tries its grasps.

    The forms look at true canonical pictures; `attempt` simulates a grasp in a scene of `validation`. Raises
    UserError as `train_policy`, and where a form looks at anything else.
    """
    for name, cfg in forms.items():
        if cfg.picture != "canonical" or cfg.with_source:
            raise UserError(f"compare: '{name}' does not look at canonical pictures alone: expected that of all forms")
    return {
        name: _result(_timed(cfg, minutes), views, validation, attempt, out / name, seed) for name, cfg in forms.items()
    }


def _timed(cfg: GraspConfig, minutes: float) -> GraspConfig:
    return replace(cfg, training=replace(cfg.training, max_steps=0, max_minutes=minutes))


def _result(
    cfg: GraspConfig, views: ViewSource, validation: ViewSource, attempt: Attempt, out: Path, seed: int
) -> FormResult:
    path = train_policy(cfg, Inputs(views, validation), out, seed)
    facts = checkpoint.load(path, "q_function").training
    everything = torch.arange(len(validation))
    pictures, intrinsics, extrinsics = (
        validation.batch(name, everything) for name in ("canonical", "intrinsics", "extrinsics")
    )
    policy = GraspPolicy.load(path)
    started = time.perf_counter()
    actions = policy.act(pictures, intrinsics, extrinsics, everything).actions.double().numpy()
    seconds = time.perf_counter() - started
    return FormResult(
        parameters=sum(p.numel() for p in build(cfg).parameters()),
        steps=facts["step"],
        metrics=facts["metrics"],
        successes=sum(attempt(index, action) for index, action in enumerate(actions)),
        scenes=len(validation),
        milliseconds=1e3 * seconds / len(validation),
    )
