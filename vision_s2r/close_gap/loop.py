"""Diagnose a robot, train for what was diagnosed, and measure what it won."""

import json
import logging
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from vision_s2r.camera.presets import preset
from vision_s2r.cli import compose
from vision_s2r.close_gap import training
from vision_s2r.close_gap.beliefs import Belief, blind, diagnosed, known, posterior
from vision_s2r.close_gap.config import CloseGapStudyConfig
from vision_s2r.close_gap.picture import draw
from vision_s2r.close_gap.summary import Closed, as_table, said, summary
from vision_s2r.close_gap.task import Task, Way, cost, losses
from vision_s2r.close_gap.withheld import Withheld, comparable, withhold
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose_all
from vision_s2r.errors import UserError
from vision_s2r.files import finite, write
from vision_s2r.options import validate
from vision_s2r.pipeline import render_sets
from vision_s2r.recording.folders import folders
from vision_s2r.render import Views
from vision_s2r.report.robot import html
from vision_s2r.results import command_line, publish
from vision_s2r.scene.machine import Machine

log = logging.getLogger(__name__)
SUMMARY, PICTURE, TABLE, COSTS = "close_gap.json", "close_gap.png", "table.json", "costs.json"


def close_gap(cfg: CloseGapStudyConfig) -> Path:
    """Close the loop for every robot; returns the summary (JSON). Goes on where it was interrupted.

    Rows: the simulator as it came, everything randomized blindly, after the diagnosis, after it with its posterior as
    ranges, and the true effects known. All but the first take the same steps from the same weights, and try as many
    grasps. Raises UserError where something does not fit.
    """
    validate(cfg.close_gap, "close_gap")
    out = Path(cfg.out) / "close_gap"
    render_sets(cfg)
    robots = _given(cfg)
    views = comparable(Views.open(cfg.data.validation.out)) if not robots else None
    start = cfg.close_gap.translator or str(training.as_it_came(cfg, out / "as_it_came"))
    came = Way(start, cfg.close_gap.policy)
    task = Task(cfg, cfg.close_gap.scenes, out / "outcomes")
    if views is not None:
        robots = withhold(views, cfg.scene, cfg.close_gap, cfg.seed, out, partial(cost, task, came))
    ways = {"as_it_came": came}
    if "everything" in cfg.close_gap.rows:
        everything = blind(preset(cfg.close_gap.everything, "close_gap.everything"), cfg.close_gap.draws, cfg.seed)
        ways["everything"] = _way(cfg, everything, start, out / "everything")
    closed = []
    for robot in robots:
        closed.append(_closed(cfg, robot, ways, task, out))
        _save(cfg, closed, out)
    return out / SUMMARY


def _given(cfg: CloseGapStudyConfig) -> list[Withheld]:
    """The user's recordings, if any; without a known truth, grasps are tried on the diagnosed robot."""
    if not cfg.recording:
        return []
    paths = folders(cfg.recording)
    if cfg.close_gap.truth and len(paths) > 1:
        raise UserError("close_gap.truth is one robot, expected one recording with it")
    truth = Path(cfg.close_gap.truth) if cfg.close_gap.truth else None
    return [Withheld(path.resolve().name, path, truth) for path in paths]


def _closed(cfg: CloseGapStudyConfig, robot: Withheld, ways: Mapping[str, Way], task: Task, out: Path) -> Closed:
    """`ways`: those that are the same for every robot."""
    folder = out / robot.name
    began = monotonic()
    report_path = _diagnosis(cfg, robot, folder)
    minutes = (monotonic() - began) / 60
    report = json.loads(report_path.read_text())
    named = diagnosed(report)
    truth = Machine.load(robot.truth) if robot.truth else None
    beliefs = {"diagnosed": known(named), "posterior": posterior(report, cfg.close_gap.draws, cfg.seed)}
    if truth is not None:
        beliefs["true_effects"] = known(truth)
    came = ways["as_it_came"]
    rows = [row for row in beliefs if row in cfg.close_gap.rows]
    ways = {**ways, **{row: _way(cfg, beliefs[row], came.translator, folder / row) for row in rows}}
    real = truth or named
    outcomes = {row: task.success(way, real) for row, way in ways.items()}
    lost = losses(task, came, real, cfg.seed)
    report = _tell(report_path, losses(task, came, named, cfg.seed), outcomes)
    costs = {row: _cost(cfg, folder.parent / row if row == "everything" else folder / row) for row in ways}
    for row in costs.keys() & {"diagnosed", "posterior"}:
        costs[row] = _diagnosis_cost(costs[row], folder, minutes)
    log.info("%s: %s, %s", robot.name, report["verdict"], report_path.with_suffix(".html"))
    return Closed(robot, report, truth, lost, outcomes, costs)


def _diagnosis(cfg: CloseGapStudyConfig, robot: Withheld, folder: Path) -> Path:
    """The report (JSON) of a robot's recording, made once."""
    path = folder / "diagnosis" / "report.json"
    if not path.exists():
        same = [f"{key}={getattr(cfg, key)}" for key in ("jobs", "backend", "seed")]
        settings = compose(DiagnoseConfig, "diagnose", same)
        diagnose_all(replace(settings, recording=str(robot.recording), out=str(path.parent)))
    return path


def _way(cfg: CloseGapStudyConfig, belief: Belief, start: str, out: Path) -> Way:
    """Everything that is trained for a belief; finished parts are found again."""
    began = monotonic()
    translator = training.translator(cfg, belief.camera, start, out / "translator")
    policy = training.policy(cfg, belief.robots, belief.tuning, out / "policy")
    if not (out / COSTS).exists():
        write(out / COSTS, json.dumps({"minutes": (monotonic() - began) / 60}))
    return Way(str(translator), str(policy), belief.tuning)


def _cost(cfg: CloseGapStudyConfig, out: Path) -> dict[str, float]:
    if not (out / COSTS).exists():
        return {"grasps": 0, "pictures": 0, "minutes": 0.0}
    views = cfg.close_gap.steps * cfg.translate.training.batch_size
    return {"grasps": cfg.close_gap.grasps, "pictures": views, **json.loads((out / COSTS).read_text())}


def _diagnosis_cost(spent: dict[str, float], folder: Path, minutes: float) -> dict[str, float]:
    """With the minutes of the diagnosis, kept from when it was made."""
    path = folder / "diagnosis-minutes.json"
    if not path.exists():
        write(path, json.dumps({"minutes": minutes}))
    return {**spent, "minutes": spent["minutes"] + json.loads(path.read_text())["minutes"]}


def _tell(report_path: Path, lost: dict[str, Any], outcomes: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The report, a robot's with what its effects cost the task and what mending them won; written so."""
    report: dict[str, Any] = json.loads(report_path.read_text())
    if report["kind"] != "robot":
        return report
    success = {row: float(held.mean()) for row, held in outcomes.items()}
    report["task"] = {**report.get("task", {}), "losses": lost, "rows": success}
    write(report_path, json.dumps(report, indent=1))
    write(report_path.with_suffix(".html"), html(report))
    return report


def _save(cfg: CloseGapStudyConfig, closed: list[Closed], out: Path) -> None:
    """All robots so far in one file, and as a picture."""
    content = summary(closed, cfg.seed)
    write(out / SUMMARY, json.dumps(finite(content), indent=1) + "\n")
    draw(content["robots"], out / PICTURE)
    publish(out / TABLE, command_line("vision-s2r close-gap"), *as_table(content))
    for line in said(content):
        log.info("%s", line)
