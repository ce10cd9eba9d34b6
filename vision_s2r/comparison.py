"""Methods side by side: each trained on the same scenes at about the same cost, with the same seeds, in one table."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import joblib

from vision_s2r import pipeline
from vision_s2r.cli import log_to_terminal
from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest
from vision_s2r.evaluate import evaluate
from vision_s2r.evaluate.config import RowConfig
from vision_s2r.finetune import Start, finetune

Released = Mapping[str, str]  # by row: a checkpoint, of a policy or of a translator

STUDENTS = ("rcan_student", "domain_randomization_student")  # rows of `vision-s2r run`; methods have none


def compare(cfg: Config) -> Path:
    """Do, or go on with, the comparison of cfg, in cfg.out; returns the page with its table.

    A row is there for each way from a real picture to a grasp: METHOD, its translator before the canonical policy, and
    METHOD_policy, its own policy on the picture itself.
    """
    cfg = trained(cfg)
    evaluate(cfg.evaluate, pipeline.test_scene(cfg))
    return Path(cfg.evaluate.out) / "index.html"


def few_real_grasps(cfg: Config) -> Path:
    """Success against the number of real grasps, in OUT/finetune; returns the summary.

    Starts are rows of the comparison, whose networks are trained where they are not yet.
    """
    found = trained(cfg).evaluate.rows
    for name in cfg.finetune.starts:
        if name not in found:
            raise UserError(f"finetune.starts: no row '{name}' in evaluate.rows, {nearest(name, found)}")
    starts = {name: Start(found[name].policy, found[name].translator) for name in cfg.finetune.starts}
    out = Path(cfg.out) / "finetune"
    return finetune(
        cfg.finetune, starts, pipeline.recorded(cfg), cfg.grasp, cfg.evaluate, pipeline.test_scene(cfg), out, cfg.jobs
    )


def trained(cfg: Config) -> Config:
    """cfg whose rows have their checkpoints: renders and trains what is missing."""
    pipeline.render_sets(cfg, real=True)
    policies = pipeline.canonical_policies(cfg)
    return replace(cfg, evaluate=replace(cfg.evaluate, rows=rows(cfg, policies, _trained(cfg, policies))))


def rows(cfg: Config, policies: list[str], released: list[list[Released]]) -> dict[str, RowConfig]:
    """The rows of cfg.evaluate with their checkpoints: `policies` a seed, `released` [method][seed]."""
    known = {name: row for name, row in cfg.evaluate.rows.items() if name not in STUDENTS}
    found = {name: replace(row, policy=policies) for name, row in known.items()}
    for seeds in released:
        for name in seeds[0]:
            paths = [each[name] for each in seeds]
            row = found[name]
            found[name] = replace(row, policy=paths) if row.translator is None else replace(row, translator=paths)
    return found


def _trained(cfg: Config, policies: list[str]) -> list[list[Released]]:
    """Every method with every seed, `cfg.jobs` at a time."""
    seeds = range(cfg.seeds)
    calls = [joblib.delayed(_one)(train, cfg, cfg.seed + k, policies[k]) for train in METHODS for k in seeds]
    found = joblib.Parallel(n_jobs=cfg.jobs)(calls)
    return [found[k * cfg.seeds : (k + 1) * cfg.seeds] for k in range(len(METHODS))]


def _one(train: Callable[[Config, int], Released], cfg: Config, seed: int, policy: str) -> Released:
    log_to_terminal()
    given = {name: replace(getattr(cfg, name), policy=policy) for name in ("adapt", "cyclegan", "graspgan")}
    return train(replace(cfg, **given), seed)


def _domain_randomization(cfg: Config, seed: int) -> Released:
    return {"domain_randomization": str(pipeline.baseline(cfg, seed))}


def _rcan(cfg: Config, seed: int) -> Released:
    return {"rcan": str(pipeline.paired_translator(_below(cfg, "rcan"), seed))}


def _pix2pix(cfg: Config, seed: int) -> Released:
    return {"pix2pix": str(pipeline.paired_translator(_below(replace(cfg, translate=cfg.pix2pix), "pix2pix"), seed))}


def _cyclegan(cfg: Config, seed: int) -> Released:
    return _adapted("cyclegan", replace(cfg, adapt=cfg.cyclegan), seed)


def _graspgan(cfg: Config, seed: int) -> Released:
    return _adapted("graspgan", replace(cfg, adapt=cfg.graspgan), seed)


def _rl_cyclegan(cfg: Config, seed: int) -> Released:
    return _adapted("rl_cyclegan", cfg, seed)


def _adapted(name: str, cfg: Config, seed: int) -> Released:
    found = pipeline.adapt(_below(cfg, name), seed)
    translator = {name: str(found.translator)} if found.translator else {}
    return {f"{name}_policy": str(found.policy)} | translator


def _below(cfg: Config, name: str) -> Config:
    """Each method in a folder of its own."""
    return replace(cfg, out=str(Path(cfg.out) / name))


METHODS: tuple[Callable[[Config, int], Released], ...] = (
    _rcan,
    _pix2pix,
    _cyclegan,
    _graspgan,
    _rl_cyclegan,
    _domain_randomization,
)
