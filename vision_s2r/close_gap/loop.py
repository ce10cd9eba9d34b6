"""Diagnose, train under the diagnosis, and measure what it won."""

import json
import logging
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import joblib
import numpy as np

from vision_s2r.camera import CameraConfig, load_config
from vision_s2r.cli import compose, log_to_terminal
from vision_s2r.close_gap.config import CloseGapStudyConfig
from vision_s2r.close_gap.picture import draw
from vision_s2r.close_gap.withheld import Withheld, withhold
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose_all
from vision_s2r.errors import UserError
from vision_s2r.evaluate import evaluate
from vision_s2r.evaluate.config import RowConfig, through_cameras
from vision_s2r.evaluate.table import Table
from vision_s2r.files import write
from vision_s2r.options import validate
from vision_s2r.paths import CONFIGS
from vision_s2r.pipeline import judge, pairs, render_sets, test_scene
from vision_s2r.recording.folders import folders
from vision_s2r.render import Views
from vision_s2r.statistics import Bootstrap, Estimate
from vision_s2r.translate import train_translator

log = logging.getLogger(__name__)
SUMMARY, PICTURE = "close_gap.json", "close_gap.png"


@dataclass(frozen=True)
class Closed:
    """One camera: the files of its diagnosis, and how well each translator grasps through it."""

    camera: Withheld
    report: dict[str, Any]
    table: Table

    def outcomes(self, row: str) -> np.ndarray:
        """bool [1, N]: whether each attempt through this camera succeeded."""
        return self.table.outcomes(row, self.table.columns[-1].name)


def close_gap(cfg: CloseGapStudyConfig) -> Path:
    """Close the loop for every camera; returns the summary (JSON). Goes on where it was interrupted.

    Rows of each camera's table: the translator as it was (before); fine-tuned under the diagnosis (after), under the
    true camera (true_effects), and under a preset that randomizes everything. All three take the same steps from the
    same weights. Raises UserError where something does not fit.
    """
    validate(cfg.close_gap, "close_gap")
    out = Path(cfg.out) / "close_gap"
    render_sets(cfg)
    cameras = _given(cfg) if cfg.recording else _withheld(cfg, out)
    reports = [_diagnosis(cfg, camera, out) for camera in cameras]
    trainings = [("everything", CONFIGS / "camera" / f"{cfg.close_gap.everything}.yaml")]
    for camera, report in zip(cameras, reports, strict=True):
        trainings.append((f"{camera.name}/after", report.parent / "patch" / "camera_randomized.yaml"))
        if camera.truth is not None:
            trainings.append((f"{camera.name}/true_effects", camera.truth))
    calls = (joblib.delayed(_fine_tuned)(cfg, load_config(path), out / name) for name, path in trainings)
    paths = joblib.Parallel(cfg.jobs)(calls)
    tuned = {name: str(path) for (name, _), path in zip(trainings, paths, strict=True)}
    closed = [
        Closed(camera, json.loads(report.read_text()), _table(cfg, camera, tuned, out))
        for camera, report in zip(cameras, reports, strict=True)
    ]
    return _summary(cfg, closed, out)


def _given(cfg: CloseGapStudyConfig) -> list[Withheld]:
    """The user's recordings; without a known truth, the diagnosis itself is what the table looks through."""
    paths = folders(cfg.recording)
    if cfg.close_gap.truth and len(paths) > 1:
        raise UserError("close_gap.truth is one camera, expected one recording with it")
    truth = Path(cfg.close_gap.truth) if cfg.close_gap.truth else None
    return [Withheld(path.resolve().name, path, truth) for path in paths]


def _withheld(cfg: CloseGapStudyConfig, out: Path) -> list[Withheld]:
    settings, validation = cfg.close_gap, Views.open(cfg.data.validation.out)
    return withhold(validation, settings.withheld, settings.frames, settings.effects, cfg.seed, out)


def _diagnosis(cfg: CloseGapStudyConfig, camera: Withheld, out: Path) -> Path:
    """The report (JSON) of a camera's recording, made once."""
    folder = out / camera.name / "diagnosis"
    if not (folder / "report.json").exists():
        settings = compose(DiagnoseConfig, "diagnose", [f"jobs={cfg.jobs}", f"seed={cfg.seed}"])
        diagnose_all(replace(settings, recording=str(camera.recording), out=str(folder)))
    return folder / "report.json"


def _fine_tuned(cfg: CloseGapStudyConfig, camera: CameraConfig, out: Path) -> Path:
    """The translator after some steps under this camera, which also chooses the checkpoint."""
    log_to_terminal()
    training = replace(
        cfg.translate.training,
        max_steps=cfg.close_gap.steps,
        max_minutes=0.0,
        learning_rate=cfg.close_gap.learning_rate,
        validate_every=max(cfg.close_gap.steps // 4, 1),
    )
    translate = replace(cfg.translate, start=cfg.close_gap.translator, training=training)
    inputs = replace(pairs(cfg), camera=camera, validation_camera=camera)
    return train_translator(translate, inputs, out, cfg.seed, judge(translate))


def _table(cfg: CloseGapStudyConfig, camera: Withheld, tuned: dict[str, str], out: Path) -> Table:
    """The transfer table through one camera."""
    looked_through = camera.truth or out / camera.name / "diagnosis" / "patch" / "camera.yaml"
    policy = [cfg.close_gap.policy]
    rows = {
        "oracle": RowConfig(policy, picture="canonical"),
        "before": RowConfig(policy, [cfg.close_gap.translator]),
        "everything": RowConfig(policy, [tuned["everything"]]),
        "after": RowConfig(policy, [tuned[f"{camera.name}/after"]]),
    }
    if camera.truth is not None:
        rows["true_effects"] = RowConfig(policy, [tuned[f"{camera.name}/true_effects"]])
    settings = through_cameras(cfg.evaluate, rows, [str(looked_through)], out / camera.name / "table")
    compared = [["after", "before"], ["after", "everything"]]
    return evaluate(replace(settings, differences=compared), test_scene(cfg))


def recovered(closed: list[Closed]) -> Estimate:
    """Of what the true effects win over before, the part that the diagnosis wins, over all cameras together."""
    bootstrap = Bootstrap(closed[0].outcomes("before").shape[1])

    def won(row: str) -> tuple[float, np.ndarray]:
        value = sum(float(one.outcomes(row).mean() - one.outcomes("before").mean()) for one in closed)
        resampled = sum(
            (bootstrap.means(one.outcomes(row)) - bootstrap.means(one.outcomes("before")) for one in closed),
            np.zeros(1),
        )
        return value, resampled

    (part, parts), (whole, wholes) = won("after"), won("true_effects")
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = np.nanquantile(parts / wholes, [0.025, 0.975])
        return Estimate(float(np.divide(part, whole)), float(low), float(high))


def _summary(cfg: CloseGapStudyConfig, closed: list[Closed], out: Path) -> Path:
    """All cameras in one file."""
    cameras = [
        {
            "camera": one.camera.name,
            "verdict": one.report["verdict"],
            "effects": {e["name"]: {k: p["value"] for k, p in e["parameters"].items()} for e in one.report["effects"]},
            "truth": load_config(one.camera.truth).effects if one.camera.truth else None,
            "shrink": one.report["gap"]["shrink"],
            "success": {row: float(one.outcomes(row).mean()) for row in one.table.rows},
            "attempts": one.outcomes("before").shape[1],
        }
        for one in closed
    ]
    content: dict[str, Any] = {"cameras": cameras}
    if all(one.camera.truth for one in closed):
        content["recovered"] = asdict(recovered(closed))
        log.info("recovered %.0f %% of what the true effects win", 100 * content["recovered"]["value"])
    draw(cameras, out / PICTURE)
    for one in closed:
        log.info(
            "%s: %s, the gap shrinks by %.0f %%: %s",
            one.camera.name,
            one.report["verdict"],
            100 * one.report["gap"]["shrink"],
            out / one.camera.name / "diagnosis" / "report.html",
        )
    return write(out / SUMMARY, json.dumps(content, indent=1) + "\n")
