"""One translator in one column: what was measured, and what became of the grasps."""

from dataclasses import dataclass

import numpy as np

from vision_s2r.metrics.measure import Measures


@dataclass(frozen=True)
class Point:
    """One training seed of a row in a column, over N scenes."""

    row: str  # with its table's name, where there are several tables
    seed: int
    column: str
    translator: str  # SHA-256 of its checkpoint
    fingerprint: str  # of all that was measured: the same in two tables is the same measurement
    success: np.ndarray  # bool [N]
    measures: Measures

    def value(self, metric: str) -> float:
        """Over all scenes; nan where nothing was there to measure."""
        numerator, denominator = self.measures[metric].sum(0)
        return float(numerator / denominator) if denominator else float("nan")

    def by_scene(self, metric: str) -> np.ndarray:
        """In each scene, [N]; nan where nothing was there to measure."""
        numerator, denominator = self.measures[metric].T
        return np.divide(numerator, denominator, out=np.full(len(numerator), np.nan), where=denominator > 0)
