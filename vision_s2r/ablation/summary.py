"""What the jobs say together: success and metrics of each variant, and how they differ from its family's reference."""

import json
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from vision_s2r.ablation.config import AblationStudyConfig
from vision_s2r.ablation.job import JobResult
from vision_s2r.evaluate.publish import percent
from vision_s2r.files import finite, write, write_table
from vision_s2r.metrics.correlation import correlated
from vision_s2r.statistics import Bootstrap, Estimate, over_trainings

FORMAT = "vision-s2r/ablation/1"
SUCCESS = "success"  # over all cameras together; "success CAMERA" through one
# Of validation, as translators report them, and whether less of it is better.
METRICS = {
    "l1": True,
    "psnr": False,
    "ssim": False,
    "object_l1": True,
    "object_iou": False,
    "depth_error": True,
    "q_difference": True,
    "auc": False,
}


@dataclass(frozen=True)
class SummaryRow:
    """One measure of one variant, and its difference from the reference's (None: of the reference itself)."""

    variant: str
    measure: str
    value: Estimate
    change: Estimate | None

    def record(self) -> dict[str, Any]:
        """JSON-able; None for an end of an interval that one seed cannot give, and for no change."""
        change = asdict(self.change) if self.change else dict.fromkeys(("value", "low", "high"))
        numbers = asdict(self.value) | {f"change_{key}".removesuffix("_value"): each for key, each in change.items()}
        return {"variant": self.variant, "measure": self.measure} | finite(numbers)


class AblationSummary:
    """Every measure of every variant. Success: bootstrapped over scenes and seeds; metrics: over seeds."""

    def __init__(self, cfg: AblationStudyConfig, results: dict[str, list[JobResult]]):
        """`results`: by variant, one for each seed, in the same order."""
        self.cfg, self.results = cfg, results
        any_arm = next(iter(results.values()))[0]
        self.cameras = list(any_arm.success)
        self.scenes = len(any_arm.success[self.cameras[0]])
        self._bootstrap = Bootstrap(self.scenes, cfg.evaluate.seed)

    @property
    def variants(self) -> list[str]:
        """In order."""
        return list(self.results)

    def family(self, variant: str) -> str:
        """Of a variant."""
        return self.cfg.ablation.definitions[variant].family

    def reference(self, variant: str) -> str | None:
        """The variant that this one is compared with; None where it is the one."""
        name = self.cfg.ablation.references[self.family(variant)]
        return None if name == variant else name

    @cached_property
    def rows(self) -> dict[tuple[str, str], SummaryRow]:
        """By variant and measure; no row for a metric that a variant does not have."""
        found = {}
        for variant in self.variants:
            for camera in (None, *self.cameras):
                measure = SUCCESS if camera is None else f"{SUCCESS} {camera}"
                found[variant, measure] = self._success(variant, measure, camera)
            for metric in METRICS:
                if all(metric in result.metrics for result in self.results[variant]):
                    found[variant, metric] = self._metric(variant, metric)
        return found

    def _success(self, variant: str, measure: str, camera: str | None) -> SummaryRow:
        ours, reference = self._outcomes(variant, camera), self.reference(variant)
        change = self._bootstrap.difference(ours, self._outcomes(reference, camera)) if reference else None
        return SummaryRow(variant, measure, self._bootstrap.success(ours), change)

    def _outcomes(self, variant: str, camera: str | None) -> np.ndarray:
        """[S, N]: success in each scene, of all cameras their mean, so that a scene stays one unit of chance."""
        cameras = self.cameras if camera is None else [camera]
        return np.array(
            [np.mean([result.success[name] for name in cameras], axis=0) for result in self.results[variant]]
        )

    def _metric(self, variant: str, metric: str) -> SummaryRow:
        ours, reference = self._metrics(variant, metric), self.reference(variant)
        theirs = self._metrics(reference, metric) if reference else None
        change = over_trainings(ours - theirs) if theirs is not None and len(theirs) else None
        return SummaryRow(variant, metric, over_trainings(ours), change)

    def _metrics(self, variant: str, metric: str) -> np.ndarray:
        """[S], or nothing where the variant has no such metric."""
        return np.array([result.metrics[metric] for result in self.results[variant] if metric in result.metrics])

    @cached_property
    def correlations(self) -> dict[str, Estimate]:
        """By metric: Spearman's ρ with success over all trainings that have it, whose variants are resampled."""
        found = {}
        for metric in METRICS:
            if variants := [variant for variant in self.variants if (variant, metric) in self.rows]:
                values = [self._metrics(variant, metric) for variant in variants]
                success = [self._outcomes(variant, None).mean(1) for variant in variants]
                found[metric] = correlated(values, success, self.cfg.evaluate.seed)
        return found

    def write(self, folder: Path) -> None:
        """ablation.csv and ablation.json; the table on the terminal."""
        records = [{"family": self.family(row.variant)} | row.record() for row in self.rows.values()]
        write_table(folder / "ablation.csv", records)
        content = {
            "format": FORMAT,
            "scenes": self.scenes,
            "cameras": self.cameras,
            "seeds": self.cfg.seeds,
            "references": self.cfg.ablation.references,
            "variants": {variant: asdict(self.cfg.ablation.definitions[variant]) for variant in self.variants},
            "rows": records,
            "correlations": finite({metric: asdict(each) for metric, each in self.correlations.items()}),
        }
        write(folder / "ablation.json", json.dumps(content, indent=1) + "\n")
        Console(width=150).print(self.text())

    def published(self) -> dict[str, Any]:
        """The table as the documentation reads it: success and its change in each column, and metrics of validation."""
        columns = [SUCCESS, *(f"{SUCCESS} {camera}" for camera in self.cameras)]
        metrics = [name for name in METRICS if any((variant, name) in self.rows for variant in self.variants)]
        rows = []
        for variant in self.variants:
            found = [self.rows[variant, name] for name in columns]
            cells = [
                percent(asdict(found[0].value)),
                *("" if row.change is None else percent(asdict(row.change)) for row in found),
            ]
            known = (self.rows.get((variant, name)) for name in metrics)
            rows.append(
                [variant.replace("_", " "), *cells, *("" if row is None else shown(row.value.value) for row in known)]
            )
        titles = ["success, %", "change, points", *(f"{camera}: change" for camera in self.cameras)]
        return {"columns": ["variant", *titles, *metrics], "rows": rows}

    def text(self) -> Table:
        """For the terminal: a line a variant, success in percent, its change in points (95 % interval), metrics.

        Last, how each metric goes with success.
        """
        table = Table("variant", "success, %", "change, points", *METRICS, box=None)
        for variant in self.variants:
            success = self.rows[variant, SUCCESS]
            cells = [
                shown(self.rows[variant, name].value.value) if (variant, name) in self.rows else "" for name in METRICS
            ]
            table.add_row(variant, interval(success.value), interval(success.change) if success.change else "", *cells)
        rho = self.correlations
        table.add_row("ρ with success", "", "", *(shown(rho[name].value) if name in rho else "" for name in METRICS))
        return table


def interval(estimate: Estimate) -> str:
    """In percent, as 85.2 (82 to 88)."""
    return f"{100 * estimate.value:.1f} ({100 * estimate.low:.0f} to {100 * estimate.high:.0f})"


def shown(value: float) -> str:
    """A metric with three digits."""
    return f"{value:.3g}"
