"""The whole way in one call: render three sets, train translators, policies and the baseline, evaluate."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import joblib

from vision_s2r.cli import log_to_terminal
from vision_s2r.config import Config
from vision_s2r.evaluate import evaluate
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.grasp import train_policy
from vision_s2r.render import Views, render
from vision_s2r.translate import train_translator


@dataclass(frozen=True)
class Trained:
    """Checkpoints of one seed."""

    translator: Path
    policy: Path
    baseline: Path | None


def run(cfg: Config) -> Path:
    """Do, or go on with, what cfg describes; returns the page with the transfer table.

    Each stage keeps what it finished: the same command goes on where it was interrupted.
    """
    test_scene = replace(cfg.scene, objects=replace(cfg.scene.objects, split="test"))
    render(cfg.scene, cfg.data.train)
    render(cfg.scene, cfg.data.validation)
    render(test_scene, cfg.data.test)
    trained = train(cfg)
    table = evaluation(cfg, trained)
    evaluate(table, test_scene)
    return Path(table.out) / "index.html"


def train(cfg: Config) -> list[Trained]:
    """Train every network of every seed, `cfg.jobs` at a time; returns the best checkpoints."""
    seeds = range(cfg.seed, cfg.seed + cfg.seeds)
    jobs: list[Callable[[Config, int], Path]] = [_translator, _policy]
    if cfg.with_baseline:
        jobs.append(_baseline)
    calls = (joblib.delayed(_logged)(job, cfg, seed) for seed in seeds for job in jobs)
    paths = joblib.Parallel(n_jobs=cfg.jobs)(calls)
    rows = [paths[k : k + len(jobs)] for k in range(0, len(paths), len(jobs))]
    return [Trained(row[0], row[1], row[2] if cfg.with_baseline else None) for row in rows]


def _logged(job: Callable[[Config, int], Path], cfg: Config, seed: int) -> Path:
    """One training, heard of also where it runs in a process of its own."""
    log_to_terminal()
    return job(cfg, seed)


def _translator(cfg: Config, seed: int) -> Path:
    """RCAN: randomised pictures through the training camera to canonical ones."""
    out = Path(cfg.out) / f"translator-{seed}"
    return train_translator(*_sets(cfg), cfg.translate, cfg.camera, cfg.validation_camera, out, seed)


def _policy(cfg: Config, seed: int) -> Path:
    """The policy that only ever sees canonical views."""
    out = Path(cfg.out) / f"policy-{seed}"
    return train_policy(*_sets(cfg), cfg.grasp, cfg.camera, out, seed, cfg.validation_camera)


def _baseline(cfg: Config, seed: int) -> Path:
    """Domain randomisation: a policy of the same size and cost on randomised pictures directly."""
    out = Path(cfg.out) / f"baseline-{seed}"
    return train_policy(*_sets(cfg), cfg.baseline, cfg.camera, out, seed, cfg.validation_camera)


def _sets(cfg: Config) -> tuple[Views, Views]:
    return Views.open(cfg.data.train.out), Views.open(cfg.data.validation.out)


def evaluation(cfg: Config, trained: list[Trained]) -> EvaluateConfig:
    """The evaluation of cfg with the checkpoints filled in."""
    translators = [str(t.translator) for t in trained]
    policies = [str(t.policy) for t in trained]
    baselines = [str(t.baseline) for t in trained if t.baseline]
    rows = dict(cfg.evaluate.rows)
    for name in ("oracle", "no_translation", "rcan"):
        rows[name] = replace(rows[name], policy=policies)
    rows["rcan"] = replace(rows["rcan"], translator=translators)
    rows["domain_randomisation"] = replace(rows["domain_randomisation"], policy=baselines)
    return replace(cfg.evaluate, rows=rows)
