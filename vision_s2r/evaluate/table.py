"""The transfer table: success by row and column, differences and ratios, as data, CSV, JSON and text."""

import json
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import rich.box
import rich.table

from vision_s2r.evaluate.cells import Cell
from vision_s2r.evaluate.columns import Column
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.files import finite, write, write_table
from vision_s2r.statistics import Bootstrap, Estimate, mcnemar, wilson

FORMAT = "vision-s2r/transfer-table/1"
VERSIONS = ("vision-s2r", "pybullet", "torch", "numpy")
ALL = "all"


@dataclass(frozen=True)
class Comparison:
    """Two rows in one column; p is McNemar's, where both have one training seed, of a difference alone."""

    column: str
    first: str
    second: str
    estimate: Estimate
    p: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON-able; null stands for a number that is not finite."""
        numbers = finite(asdict(self.estimate))
        return {"column": self.column, "first": self.first, "second": self.second, **numbers, "p": self.p}


@dataclass(frozen=True)
class Table:
    """The finished cells, [row, column] to one for each training seed, and what they came of."""

    cfg: EvaluateConfig
    scenes: Scenes
    columns: list[Column]
    checkpoints: dict[str, list[dict[str, Any]]]  # by row, one for each training seed
    cells: dict[tuple[str, str], list[Cell]]

    @property
    def rows(self) -> list[str]:
        """The rows there are, in order."""
        return list(self.checkpoints)

    @cached_property
    def _bootstrap(self) -> Bootstrap:
        return Bootstrap(len(self.scenes), self.cfg.seed)

    def outcomes(self, row: str, column: str) -> np.ndarray:
        """Whether each attempt succeeded, bool [S, N]: training seeds, scenes."""
        return np.stack([cell.success for cell in self.cells[row, column]])

    def success(self, row: str, column: str) -> Estimate:
        """Over all training seeds; see `Bootstrap.success`."""
        return self._success[row, column]

    @cached_property
    def _success(self) -> dict[tuple[str, str], Estimate]:
        return {key: self._bootstrap.success(self.outcomes(*key)) for key in self.cells}

    def overall(self, row: str) -> np.ndarray:
        """Share of the columns' attempts that succeeded, float [S, N]: training seeds, scenes."""
        return np.mean([self.outcomes(row, column.name) for column in self.columns], axis=0)

    @cached_property
    def differences(self) -> list[Comparison]:
        """Success of one row minus another's, in each column."""
        found = []
        for first, second, column in self._pairs(self.cfg.differences):
            one, other = self.outcomes(first, column), self.outcomes(second, column)
            p = mcnemar(one[0], other[0]) if len(one) == len(other) == 1 else None
            found.append(Comparison(column, first, second, self._bootstrap.difference(one, other), p))
        return found

    @cached_property
    def ratios(self) -> list[Comparison]:
        """Success of one row over another's, in each column."""
        return [
            Comparison(
                column,
                first,
                second,
                self._bootstrap.ratio(self.outcomes(first, column), self.outcomes(second, column)),
            )
            for first, second, column in self._pairs(self.cfg.ratios)
        ]

    def _pairs(self, pairs: list[list[str]]) -> list[tuple[str, str, str]]:
        there = [pair for pair in pairs if all(name in self.checkpoints for name in pair)]
        return [(first, second, column.name) for first, second in there for column in self.columns]

    def records(self) -> list[dict[str, Any]]:
        """The table, long: each cell for each training seed (Wilson's interval), then over all of them."""
        found = []
        for (row, column), cells in self.cells.items():
            count = len(self.scenes)
            for k, cell in enumerate(cells):
                successes = int(cell.success.sum())
                found.append(_record(row, column, k, successes, count, wilson(successes, count)))
            total = int(self.outcomes(row, column).sum())
            found.append(_record(row, column, ALL, total, count * len(cells), self.success(row, column)))
        return found

    def write(self, folder: Path) -> None:
        """table.csv and table.json."""
        write_table(folder / "table.csv", self.records())
        write(folder / "table.json", json.dumps(self.to_dict(), indent=1) + "\n")

    def to_dict(self) -> dict[str, Any]:
        """All of it, JSON-able, without a date: the same inputs give the same."""
        manifest = self.scenes.views.manifest
        return {
            "format": FORMAT,
            "scenes": {"folder": self.cfg.scenes, "count": len(self.scenes), "scene": manifest.scene}
            | {"render": manifest.render, "versions": manifest.versions},
            "seed": self.cfg.seed,
            "columns": [asdict(column) for column in self.columns],
            "cells": self.records(),
            "differences": [comparison.to_dict() for comparison in self.differences],
            "ratios": [comparison.to_dict() for comparison in self.ratios],
            "checkpoints": self.checkpoints,
            "versions": {name: version(name) for name in VERSIONS},
        }

    def text(self) -> rich.table.Table:
        """For the terminal: a line for each column, success in percent with its interval."""
        table = rich.table.Table(
            title=f"Grasp success in {len(self.scenes)} scenes of unseen objects, % (95 % interval)",
            box=rich.box.SIMPLE,
            show_edge=False,
            pad_edge=False,
        )
        table.add_column("pictures", no_wrap=True)
        for row in self.rows:
            table.add_column(row.replace("_", " "), justify="right")
        for column in self.columns:
            table.add_row(
                column.name.replace("_", " "), *[_percent(self.success(row, column.name)) for row in self.rows]
            )
        return table


def _percent(estimate: Estimate) -> str:
    """In percent, as 85.2 (82–88)."""
    return f"{100 * estimate.value:.1f} ({100 * estimate.low:.0f}–{100 * estimate.high:.0f})"


def _record(
    row: str, column: str, seed: int | str, successes: int, attempts: int, estimate: Estimate
) -> dict[str, Any]:
    rate = {"rate": estimate.value, "low": estimate.low, "high": estimate.high}
    return {"row": row, "column": column, "seed": seed, "successes": successes, "attempts": attempts} | rate
