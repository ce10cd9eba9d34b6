"""What was found, as data, CSV, JSON and text."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import rich.box
from rich.table import Table

from vision_s2r.files import finite, write, write_table
from vision_s2r.metrics.correlation import Correlation, correlate
from vision_s2r.metrics.points import Point
from vision_s2r.statistics import Bootstrap, Estimate, wilson

FORMAT = "vision-s2r/metrics/1"
ALL = "all"
SUCCESS = "success"
SHARES = (SUCCESS, "dropped", "moved", "recoloured")
HIGHER_IS_BETTER = ("psnr", "ssim", "object_iou")
COUNTS = (*SHARES, "invented")  # which is a scene, and may be above 1


@dataclass(frozen=True)
class Record:
    """A metric of a row in a column (or all) for a training seed (or all), with its interval over scenes and seeds."""

    row: str
    column: str
    seed: int | str
    metric: str
    estimate: Estimate


@dataclass(frozen=True)
class Report:
    """Points, what they say of each row, and how each metric goes with success."""

    points: list[Point]
    records: list[Record]
    correlations: list[Correlation]

    @classmethod
    def of(cls, points: list[Point], seed: int) -> "Report":
        """`seed`: of the resamples."""
        bootstraps = {count: Bootstrap(count, seed) for count in {len(point.success) for point in points}}
        records = []
        for key, group in _groups(points).items():
            bootstrap = bootstraps[len(group[0].success)]
            for metric in (SUCCESS, *group[0].measures):
                records.append(Record(*key, metric, _estimate(group, metric, bootstrap)))
        return cls(points, records, correlate(points, seed))

    @property
    def rows(self) -> list[str]:
        """In order."""
        return list(dict.fromkeys(point.row for point in self.points))

    @property
    def metrics(self) -> list[str]:
        """In order."""
        return list(self.points[0].measures)

    def overall(self, row: str, metric: str) -> Estimate:
        """Of a row, over all columns and seeds."""
        wanted = (row, metric, ALL, ALL)
        return next(r.estimate for r in self.records if (r.row, r.metric, r.column, r.seed) == wanted)

    def write(self, folder: Path) -> None:
        """metrics.csv, a line a record, and metrics.json."""
        lines = [{**asdict(record), **asdict(record.estimate)} for record in self.records]
        for line in lines:
            del line["estimate"]
        write_table(folder / "metrics.csv", lines)
        data = {"format": FORMAT, "records": lines, "correlations": [asdict(each) for each in self.correlations]}
        write(folder / "metrics.json", json.dumps(finite(data), indent=1) + "\n")

    def tables(self) -> list[Table]:
        """For the terminal: metrics by row, then correlations."""
        by_row = _table("Over all columns (95 % interval over scenes and training seeds)", self.rows)
        for metric in (SUCCESS, *self.metrics):
            by_row.add_row(metric.replace("_", " "), *[_text(self.overall(row, metric)) for row in self.rows])
        clusters = len({point.translator for point in self.points})
        title = f"Spearman's ρ with success (95 % interval over {clusters} translators)"
        kinds = ("overall", "within_columns", "within_points")
        by_metric = _table(title, [{"within_points": "over scenes"}.get(kind, kind) for kind in kinds])
        for each in self.correlations:
            by_metric.add_row(each.metric.replace("_", " "), *[_text(getattr(each, kind)) for kind in kinds])
        return [by_row, by_metric]

    def verdict(self) -> str:
        """Which metric foretells success, by each of the correlations, and where the difference of Q stands."""
        return "\n".join(
            _verdict(self.correlations, kind, words)
            for kind, words in (
                ("overall", "over all points"),
                ("within_columns", "within columns"),
                ("within_points", "scene by scene"),
            )
        )


def _verdict(correlations: list[Correlation], kind: str, words: str) -> str:
    """By ρ with the sign that it should have: no metric is praised for going the wrong way."""
    found: dict[str, Estimate] = {each.metric: getattr(each, kind) for each in correlations}
    right = {m: each.value if m in HIGHER_IS_BETTER else -each.value for m, each in found.items()}
    ranked = sorted((m for m, value in right.items() if math.isfinite(value)), key=lambda m: -right[m])
    if not ranked:
        return f"{words}: too few points"
    best = found[ranked[0]]
    sure = right[ranked[0]] > 0 and not best.low <= 0 <= best.high
    doubt = "" if sure else ", which its interval or its sign does not bear out"
    text = f"{words}, {ranked[0]} goes with success most closely (ρ = {best.value:.2f}{doubt})"
    if "q_difference" not in ranked[1:]:
        return text
    return f"{text}; q_difference is number {ranked.index('q_difference') + 1} (ρ = {found['q_difference'].value:.2f})"


def _groups(points: Sequence[Point]) -> dict[tuple[str, str, int | str], list[Point]]:
    """The points of each row, of one or all columns, and of one or all seeds."""
    groups: dict[tuple[str, str, int | str], list[Point]] = {}
    for point in points:
        for column in (point.column, ALL):
            for seed in (point.seed, ALL):
                groups.setdefault((point.row, column, seed), []).append(point)
    return groups


def _estimate(group: list[Point], metric: str, bootstrap: Bootstrap) -> Estimate:
    """Over the group's scenes and training seeds; of none, or a share of all, Wilson's with a trial a scene."""
    seeds = sorted({point.seed for point in group})
    parts = np.stack([sum(_parts(p, metric) for p in group if p.seed == k) for k in seeds])
    numerator, denominator = np.moveaxis(parts, -1, 0)
    if not denominator.any():
        return Estimate(math.nan, math.nan, math.nan)
    value = numerator.sum() / denominator.sum()
    if (metric in COUNTS and value == 0) or (metric in SHARES and value == 1):
        return wilson(round(value * bootstrap.scenes), bootstrap.scenes)
    return bootstrap.ratio(numerator, denominator)


def _parts(point: Point, metric: str) -> np.ndarray:
    if metric == SUCCESS:
        return np.stack([point.success, np.ones(len(point.success))], 1)
    return point.measures[metric]


def _table(title: str, columns: Sequence[str]) -> Table:
    table = Table(title=title, box=rich.box.SIMPLE, show_edge=False, pad_edge=False)
    table.add_column("metric", no_wrap=True)
    for column in columns:
        table.add_column(column.replace("_", " "), justify="right", no_wrap=True)
    return table


def _text(estimate: Estimate) -> str:
    if not math.isfinite(estimate.value):
        return "–"
    interval = f" ({estimate.low:.3g} to {estimate.high:.3g})" if math.isfinite(estimate.low) else ""
    return f"{estimate.value:.3g}{interval}"
