"""From finished evaluations to what their translations keep, and which metric goes with success."""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import cache, partial
from pathlib import Path

from rich.console import Console
from torch import Tensor

from vision_s2r.errors import UserError
from vision_s2r.evaluate import columns
from vision_s2r.evaluate.cells import fingerprint
from vision_s2r.evaluate.rows import Loaders, Runner
from vision_s2r.metrics import pictures
from vision_s2r.metrics.config import MetricsConfig, checked
from vision_s2r.metrics.evaluations import Evaluation
from vision_s2r.metrics.measure import DEFINITIONS, Measurer, Measures, stored
from vision_s2r.metrics.points import Point
from vision_s2r.metrics.report import Report
from vision_s2r.progress import tracked


def metrics(cfg: MetricsConfig, loaders: Loaders | None = None) -> Report:
    """Measure what is not yet measured; write metrics.csv, metrics.json, metrics.png, objects.png into `cfg.out`.

    Raises UserError for folders that are no finished evaluations, ones whose scenes or checkpoints are no longer what
    they were, and where no row has a translator.
    """
    evaluations = [Evaluation.open(Path(folder), loaders or Loaders()) for folder in checked(cfg)]
    total = sum(len(each.columns) * sum(map(len, each.rows.values())) for each in evaluations)
    if not total:
        raise UserError(f"tables = {cfg.tables}: no row there has a translator, expected at least one")
    out = Path(cfg.out)
    found = (point for each in evaluations for point in _points(each, out, alone=len(evaluations) == 1))
    report = Report.of(list(tracked(found, total, "translations")), cfg.seed)
    report.write(out)
    pictures.scatter(report, out / "metrics.png")
    pictures.objects(report, out / "objects.png")
    for table in report.tables():
        Console().print(table)
    Console().print(report.verdict())
    Console(stderr=True).print(f"{out / 'metrics.png'} and {out / 'objects.png'} show what it looks like")
    return report


def _points(evaluation: Evaluation, out: Path, alone: bool) -> Iterator[Point]:
    """Column by column, so that each column's pictures are made once, and only where something is to be measured."""
    scenes, measurer = evaluation.scenes, Measurer(evaluation.scenes)
    for column in evaluation.columns:
        source = cache(partial(columns.pictures, column, scenes.views, evaluation.seed))
        for row, runners in evaluation.rows.items():
            for k, runner in enumerate(runners):
                success = evaluation.success(row, column, k)
                key = fingerprint(DEFINITIONS, asdict(column), runner.inputs, scenes.inputs, evaluation.seed)
                measures = stored(out / "cells", key, partial(_measured, measurer, runner, source))
                name = row if alone else f"{evaluation.folder}: {row}"
                translator = runner.checkpoints["translator"]["sha256"]
                yield Point(name, k, column.name, translator, key, success, measures)


def _measured(measurer: Measurer, runner: Runner, source: Callable[[], Tensor]) -> Measures:
    return measurer(runner, source())
