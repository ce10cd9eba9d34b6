"""One job: a variant trained with one seed, and what became of its grasps."""

import json
import logging
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r import pipeline
from vision_s2r.ablation.config import AblationStudyConfig, check, selected
from vision_s2r.ablation.families import family_of
from vision_s2r.errors import UserError
from vision_s2r.evaluate import evaluate
from vision_s2r.evaluate.config import RowConfig, through_cameras
from vision_s2r.files import write
from vision_s2r.threads import one_thread
from vision_s2r.training import checkpoint

log = logging.getLogger(__name__)
RESULT = "result.json"
TABLE, ROW = "table", "translator"  # a job's transfer table


@dataclass(frozen=True)
class JobResult:
    """A finished job."""

    success: dict[str, np.ndarray]  # by camera: bool [N], of the same scenes in every job
    metrics: dict[str, float]  # of the released checkpoint, on validation views


def jobs(cfg: AblationStudyConfig) -> dict[str, list[AblationStudyConfig]]:
    """By selected variant: the configuration of its job for each seed."""
    seeds = range(cfg.seed, cfg.seed + cfg.seeds)
    return {
        variant: [replace(cfg, ablation=replace(cfg.ablation, variant=variant, seed=seed)) for seed in seeds]
        for variant in selected(cfg.ablation)
    }


def changed(cfg: AblationStudyConfig) -> AblationStudyConfig:
    """cfg as its variant changes it. Raises UserError where a change cannot be."""
    return family_of(cfg.ablation).changed(cfg, cfg.ablation.definitions[cfg.ablation.variant].changes)


def run(cfg: AblationStudyConfig) -> Path:
    """Train and evaluate `cfg.ablation.variant` with `cfg.ablation.seed` in OUT/VARIANT-SEED; returns the result.

    What is finished is not repeated, what was interrupted goes on. Raises UserError where something does not fit.
    """
    ready, path = _configured(cfg), folder(cfg) / RESULT
    if _finished(path, _settings(ready)):
        return path
    with one_thread():
        translator = family_of(ready.ablation).train(replace(ready, out=str(folder(cfg))), ready.ablation.seed)
        success = _success(ready, translator)
    metrics = checkpoint.load(translator, "translator").training["metrics"]
    content = {"settings": _settings(ready), "metrics": metrics, "success": success}
    write(path, json.dumps(content, indent=1) + "\n")
    every = [folder(job) / RESULT for seeds in jobs(cfg).values() for job in seeds]
    done = sum(each.exists() for each in every)
    percent = 100 * np.mean(list(success.values()))
    log.info("%s: success %.1f %%, %d of %d jobs are done", folder(cfg), percent, done, len(every))
    return path


def read(cfg: AblationStudyConfig) -> JobResult:
    """What `run` left for the variant and seed of cfg. Raises UserError unless it ran with this configuration."""
    path = folder(cfg) / RESULT
    if not _finished(path, _settings(_configured(cfg))):
        raise UserError(f"{path}: there is no result of this configuration: expected a finished job")
    found = json.loads(path.read_text())
    success = {camera: np.array(values, dtype=bool) for camera, values in found["success"].items()}
    return JobResult(success, found["metrics"])


def folder(cfg: AblationStudyConfig) -> Path:
    """The folder of the variant and seed of cfg."""
    return Path(cfg.out) / f"{cfg.ablation.variant}-{cfg.ablation.seed}"


def sheet(cfg: AblationStudyConfig) -> Path:
    """Of a finished job: the first scenes through the first camera, and below each its translation (PNG)."""
    return folder(cfg) / TABLE / "strip.png"


def _configured(cfg: AblationStudyConfig) -> AblationStudyConfig:
    """cfg as its variant changes it, its seed's policy frozen as Q. Raises UserError where something does not fit."""
    check(cfg.ablation, cfg.seeds)
    if not cfg.ablation.variant or not cfg.ablation.policy:
        raise UserError("ablation.variant or ablation.policy is empty: expected both in a job")
    policy = cfg.ablation.policy[cfg.ablation.seed - cfg.seed]
    cfg = replace(cfg, translate=replace(cfg.translate, q_function=policy))
    return changed(cfg)


def _settings(cfg: AblationStudyConfig) -> dict[str, Any]:
    """JSON-able: what the result of a configured job depends on; what is finished in its folder, the folder knows."""
    family = family_of(cfg.ablation)
    keys = (family.key, "scene", "camera", "validation_camera")
    return {key: asdict(getattr(cfg, key)) for key in keys} | {
        "policy": cfg.translate.q_function,
        "data": [each.out for each in (cfg.data.pairs, cfg.data.train, cfg.data.validation, cfg.data.test)],
        "table": [cfg.ablation.cameras, cfg.ablation.scenes, cfg.evaluate.seed],
    }


def _finished(path: Path, settings: dict[str, Any]) -> bool:
    """Whether there is a result of these settings."""
    return path.exists() and bool(json.loads(path.read_text())["settings"] == json.loads(json.dumps(settings)))


def _success(cfg: AblationStudyConfig, translator: Path) -> dict[str, list[int]]:
    """By camera: whether the grasp in each scene held, 0 or 1."""
    rows = {ROW: RowConfig([cfg.translate.q_function], [str(translator)])}
    settings = through_cameras(cfg.evaluate, rows, cfg.ablation.cameras, folder(cfg) / TABLE)
    alone = replace(settings, limit=cfg.ablation.scenes, workers=1)  # jobs share the cores already
    table = evaluate(alone, pipeline.test_scene(cfg))
    return {column.name: table.outcomes(ROW, column.name)[0].astype(int).tolist() for column in table.columns}
