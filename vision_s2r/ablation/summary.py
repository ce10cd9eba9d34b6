"""What the jobs say together: success and metrics of each arm, and how they differ from its family's reference."""

import json
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from vision_s2r.ablation.job import Result
from vision_s2r.config import Config
from vision_s2r.content.correlation import over_clusters
from vision_s2r.files import finite, write, write_table
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
class Row:
    """One measure of one arm, and its difference from the reference's (None: of the reference itself)."""

    arm: str
    measure: str
    value: Estimate
    change: Estimate | None

    def record(self) -> dict[str, Any]:
        """JSON-able; None for an end of an interval that one seed cannot give, and for no change."""
        change = asdict(self.change) if self.change else dict.fromkeys(("value", "low", "high"))
        numbers = asdict(self.value) | {f"change_{key}".removesuffix("_value"): each for key, each in change.items()}
        return {"arm": self.arm, "measure": self.measure} | finite(numbers)


class Summary:
    """Every measure of every arm. Success: bootstrapped over scenes and seeds; metrics: over seeds."""

    def __init__(self, cfg: Config, results: dict[str, list[Result]]):
        """`results`: by arm, one for each seed, in the same order."""
        self.cfg, self.results = cfg, results
        any_arm = next(iter(results.values()))[0]
        self.cameras = list(any_arm.success)
        self.scenes = len(any_arm.success[self.cameras[0]])
        self._bootstrap = Bootstrap(self.scenes, cfg.evaluate.seed)

    @property
    def arms(self) -> list[str]:
        """In order."""
        return list(self.results)

    def family(self, arm: str) -> str:
        """Of an arm."""
        return self.cfg.ablation.definitions[arm].family

    def reference(self, arm: str) -> str | None:
        """The arm that this one is compared with; None where it is the one."""
        name = self.cfg.ablation.references[self.family(arm)]
        return None if name == arm else name

    @cached_property
    def rows(self) -> dict[tuple[str, str], Row]:
        """By arm and measure; no row for a metric that an arm does not have."""
        found = {}
        for arm in self.arms:
            for camera in (None, *self.cameras):
                measure = SUCCESS if camera is None else f"{SUCCESS} {camera}"
                found[arm, measure] = self._success(arm, measure, camera)
            for metric in METRICS:
                if all(metric in result.metrics for result in self.results[arm]):
                    found[arm, metric] = self._metric(arm, metric)
        return found

    def _success(self, arm: str, measure: str, camera: str | None) -> Row:
        ours, reference = self._outcomes(arm, camera), self.reference(arm)
        change = self._bootstrap.difference(ours, self._outcomes(reference, camera)) if reference else None
        return Row(arm, measure, self._bootstrap.success(ours), change)

    def _outcomes(self, arm: str, camera: str | None) -> np.ndarray:
        """[S, N]: success in each scene, of all cameras their mean, so that a scene stays one unit of chance."""
        cameras = self.cameras if camera is None else [camera]
        return np.array([np.mean([result.success[name] for name in cameras], axis=0) for result in self.results[arm]])

    def _metric(self, arm: str, metric: str) -> Row:
        ours, reference = self._metrics(arm, metric), self.reference(arm)
        theirs = self._metrics(reference, metric) if reference else None
        change = over_trainings(ours - theirs) if theirs is not None and len(theirs) else None
        return Row(arm, metric, over_trainings(ours), change)

    def _metrics(self, arm: str, metric: str) -> np.ndarray:
        """[S], or nothing where the arm has no such metric."""
        return np.array([result.metrics[metric] for result in self.results[arm] if metric in result.metrics])

    @cached_property
    def correlations(self) -> dict[str, Estimate]:
        """By metric: Spearman's ρ with success over all trainings that have it, whose arms are resampled."""
        found = {}
        for metric in METRICS:
            if arms := [arm for arm in self.arms if (arm, metric) in self.rows]:
                values = [self._metrics(arm, metric) for arm in arms]
                success = [self._outcomes(arm, None).mean(1) for arm in arms]
                found[metric] = over_clusters(values, success, self.cfg.evaluate.seed)
        return found

    def write(self, folder: Path) -> None:
        """ablation.csv and ablation.json; the table on the terminal."""
        records = [{"family": self.family(row.arm)} | row.record() for row in self.rows.values()]
        write_table(folder / "ablation.csv", records)
        content = {
            "format": FORMAT,
            "scenes": self.scenes,
            "cameras": self.cameras,
            "seeds": self.cfg.seeds,
            "references": self.cfg.ablation.references,
            "arms": {arm: asdict(self.cfg.ablation.definitions[arm]) for arm in self.arms},
            "rows": records,
            "correlations": finite({metric: asdict(each) for metric, each in self.correlations.items()}),
        }
        write(folder / "ablation.json", json.dumps(content, indent=1) + "\n")
        Console(width=150).print(self.text())

    def text(self) -> Table:
        """For the terminal: a line an arm, success in percent, its change in points (95 % interval), metrics.

        Last, how each metric goes with success.
        """
        table = Table("arm", "success, %", "change, points", *METRICS, box=None)
        for arm in self.arms:
            success = self.rows[arm, SUCCESS]
            cells = [shown(self.rows[arm, name].value.value) if (arm, name) in self.rows else "" for name in METRICS]
            table.add_row(arm, interval(success.value), interval(success.change) if success.change else "", *cells)
        rho = self.correlations
        table.add_row("ρ with success", "", "", *(shown(rho[name].value) if name in rho else "" for name in METRICS))
        return table


def interval(estimate: Estimate) -> str:
    """In percent, as 85.2 (82 to 88)."""
    return f"{100 * estimate.value:.1f} ({100 * estimate.low:.0f} to {100 * estimate.high:.0f})"


def shown(value: float) -> str:
    """A metric with three digits."""
    return f"{value:.3g}"
