"""Methods side by side: each trained on the same scenes at about the same cost, with the same seeds, in one table."""

from dataclasses import replace
from pathlib import Path

from vision_s2r import parallel, pipeline
from vision_s2r.cli import log_to_terminal
from vision_s2r.config import Config
from vision_s2r.errors import UserError, nearest
from vision_s2r.evaluate import evaluate
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.finetune import Start, finetune
from vision_s2r.methods import METHODS, MethodInputs, Released, Train

CANONICAL = ("oracle", "no_translation")  # rows of the canonical policy alone, beside the methods'


def compare(cfg: Config) -> Path:
    """Do, or go on with, the comparison of cfg, in cfg.out; returns the page with its table.

    A row is there for each way from a real picture to a grasp: METHOD, its translator before the canonical policy, and
    METHOD_policy, its own policy on the picture itself. Raises UserError where a method of `cfg.methods` is unknown.
    """
    cfg = trained(cfg)
    evaluate(cfg.evaluate, pipeline.test_scene(cfg))
    return Path(cfg.evaluate.out) / "index.html"


def few_real_grasps(cfg: Config) -> Path:
    """Success against the number of real grasps, in OUT/finetune; returns the summary.

    Starts are rows of the comparison, whose networks are trained where they are not yet.
    """
    found = {name: row for name, row in trained(cfg).evaluate.rows.items() if row.present}
    for name in cfg.finetune.starts:
        if name not in found:
            raise UserError(f"finetune.starts: no row '{name}' in evaluate.rows, {nearest(name, found)}")
    starts = {name: Start(found[name].policy, found[name].translator) for name in cfg.finetune.starts}
    out = Path(cfg.out) / "finetune"
    recorded, scene = pipeline.recorded(cfg), pipeline.test_scene(cfg)
    return finetune(cfg.finetune, starts, recorded, cfg.grasp, cfg.evaluate, scene, out, cfg.jobs, cfg.backend)


def trained(cfg: Config) -> Config:
    """cfg whose rows have their checkpoints: renders and trains what is missing."""
    methods = METHODS.select(cfg.methods, "methods")
    pipeline.render_sets(cfg)
    pipeline.render_sets(cfg, "real")
    policies = pipeline.canonical_policies(cfg)
    return replace(cfg, evaluate=_evaluation(cfg.evaluate, policies, _trained(cfg, methods, policies)))


def _evaluation(cfg: EvaluateConfig, policies: list[str], released: list[list[Released]]) -> EvaluateConfig:
    """The table with the checkpoints of its rows: `policies` a seed, `released` [method][seed]."""
    rows = cfg.rows | {name: replace(cfg.rows[name], policy=policies) for name in CANONICAL}
    for seeds in released:
        for name in seeds[0]:
            if name not in cfg.rows:
                raise UserError(f"evaluate.rows: no row '{name}', which a method released, {nearest(name, cfg.rows)}")
            row, paths = cfg.rows[name], [str(each[name]) for each in seeds]
            own_policy = row.translator is None
            rows[name] = replace(row, policy=paths) if own_policy else replace(row, policy=policies, translator=paths)
    return replace(cfg, rows=rows)


def _trained(cfg: Config, methods: dict[str, Train], policies: list[str]) -> list[list[Released]]:
    """Every method with every seed, `cfg.jobs` at a time."""
    calls = ((name, cfg, k, policies[k]) for name in methods for k in range(cfg.seeds))
    found = list(parallel.run(_one, calls, cfg.jobs, cfg.backend))
    return [found[k * cfg.seeds : (k + 1) * cfg.seeds] for k in range(len(methods))]


def _one(name: str, cfg: Config, k: int, policy: str) -> Released:
    """One method with one seed, in a folder of its own."""
    log_to_terminal()
    inputs = MethodInputs(pipeline.pairs(cfg), pipeline.labelled(cfg), pipeline.recorded(cfg), policy)
    train = METHODS.select([name], "methods")[name]
    return train(cfg, inputs, Path(cfg.out) / f"{name}-{cfg.seed + k}", cfg.seed + k)
