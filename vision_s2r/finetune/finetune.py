"""Train on the first n real grasps, for each n and start, and grasp in unseen scenes."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vision_s2r import parallel
from vision_s2r.cli import log_to_terminal
from vision_s2r.errors import UserError
from vision_s2r.evaluate import EvaluateConfig, Table, evaluate
from vision_s2r.evaluate.config import RowConfig, through_cameras
from vision_s2r.files import write, write_table
from vision_s2r.finetune.config import SCRATCH, FinetuneConfig, check
from vision_s2r.grasp import GraspConfig, train_policy
from vision_s2r.grasp.forms import load_configuration
from vision_s2r.render import Recorded
from vision_s2r.scene import SceneConfig
from vision_s2r.statistics import Bootstrap
from vision_s2r.training import Inputs, checkpoint
from vision_s2r.translate import Translator

SUMMARY, CSV, PICTURE = "finetune.json", "finetune.csv", "finetune.png"


@dataclass(frozen=True)
class Start:
    """What a fine-tuning begins with: checkpoints of policies, one for each training seed, and what they look through.

    A translator of None: the policy looks at real pictures as they are.
    """

    policy: list[str]
    translator: list[str] | None = None


@dataclass(frozen=True)
class Job:
    """One training: a start's seed and a number of scenes."""

    start: str
    seed: int
    policy: str  # empty: none
    translator: str | None
    count: int  # of grasps asked for

    @property
    def name(self) -> str:
        """Of its folder and row."""
        return f"{self.start}_{self.count}"


def finetune(
    cfg: FinetuneConfig,
    starts: Mapping[str, Start],
    recorded: Recorded,
    scratch: GraspConfig,
    table: EvaluateConfig,
    scene: SceneConfig,
    out: Path,
    jobs: int = 1,
    backend: str = "local",
) -> Path:
    """Do, or go on with, all trainings and the evaluation; returns the summary (JSON).

    `starts`: by name. Grasps are taken in whole scenes, the first of `recorded`. `scratch` is the form of the policy
    that knows real grasps alone, `table` the evaluation, of which rows and columns are set here. Raises UserError where
    there are too few real grasps, and as `train_policy` and `evaluate`.
    """
    check(cfg)
    each = recorded.batch("success", torch.arange(1)).shape[1]
    if max(cfg.counts) // each > len(recorded):
        most = len(recorded) * each
        raise UserError(f"finetune.counts has {max(cfg.counts)}: {most} real grasps are recorded, expected no more")
    todo = list(_jobs(cfg, starts))
    calls = ((cfg, job, recorded, scratch, max(job.count // each, 1), out) for job in todo)
    paths = list(parallel.run(_trained, calls, jobs, backend))
    rows: dict[str, RowConfig] = {}
    for job, path in zip(todo, paths, strict=True):
        row = rows.setdefault(job.name, RowConfig([], None if job.translator is None else [], trained_on=""))
        row.policy.append(str(path))
        if row.translator is not None and job.translator is not None:
            row.translator.append(job.translator)
        row.trained_on = checkpoint.load(path, "q_function").configuration["picture"]
    settings = replace(through_cameras(table, rows, list(cfg.cameras), out / "table"), limit=cfg.limit)
    return _summary(cfg, evaluate(settings, scene), todo, each, out)


def _jobs(cfg: FinetuneConfig, starts: Mapping[str, Start]) -> Iterator[Job]:
    for name, start in {**starts, SCRATCH: Start([""] * cfg.seeds)}.items():
        translators: Sequence[str | None] = start.translator or [None] * len(start.policy)
        for seed, (policy, translator) in enumerate(zip(start.policy, translators, strict=True)):
            yield from (Job(name, seed, policy, translator, count) for count in cfg.counts if policy or count)


def _trained(cfg: FinetuneConfig, job: Job, recorded: Recorded, scratch: GraspConfig, scenes: int, out: Path) -> Path:
    """The policy after its real grasps; with none of them the one it begins with."""
    log_to_terminal()
    if not job.count:
        return Path(job.policy)
    some = recorded.first(scenes)
    if job.translator is not None:
        some = some.replaced(_translated(job.translator, some))
    steps = round(cfg.epochs * scenes / cfg.training.batch_size)
    if job.policy:
        known = replace(load_configuration(job.policy), start=job.policy)
        rate = cfg.training.learning_rate
        steps = min(max(steps, cfg.least_steps), cfg.most_steps)
    else:
        known, rate = scratch, scratch.training.learning_rate
        steps = min(max(10 * steps, cfg.least_steps), cfg.scratch_steps)
    training = replace(cfg.training, max_steps=steps, validate_every=steps, learning_rate=rate)
    settings = replace(known, picture="seen", validate_on="seen", rectification=0.0, negatives=0, training=training)
    folder = out / f"{job.name}-{job.seed}"
    # Validated once, at the end: nothing is chosen, the last weights are taken.
    return train_policy(settings, Inputs(some, some.first(1)), folder, job.seed)


def _translated(path: str, recorded: Recorded) -> Tensor:
    return Translator.load(path)(recorded.batch("seen", torch.arange(len(recorded))))


def _summary(cfg: FinetuneConfig, table: Table, todo: list[Job], each: int, out: Path) -> Path:
    """Success of each start at each number of grasps, over all cameras together."""
    from vision_s2r.finetune.picture import draw  # matplotlib takes half a second to import

    bootstrap = Bootstrap(len(table.scenes), table.cfg.seed)
    points: list[dict[str, Any]] = []
    for job in {job.name: job for job in todo}.values():
        estimate = bootstrap.success(table.overall(job.name))
        seeds = len(table.checkpoints[job.name])
        grasps = job.count // each * each
        attempts = seeds * len(table.scenes) * len(cfg.cameras)
        points.append({"start": job.start, "grasps": grasps, "seeds": seeds, "attempts": attempts} | asdict(estimate))
    write_table(out / CSV, points)
    draw(points, out / PICTURE)
    return write(out / SUMMARY, json.dumps(points, indent=1) + "\n")
