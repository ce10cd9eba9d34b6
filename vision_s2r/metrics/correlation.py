"""Which metric goes with grasp success."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import ConstantInputWarning, spearmanr

from vision_s2r.metrics.points import Point
from vision_s2r.statistics import Estimate, over_clusters

FEWEST = 3  # points that are correlated


@dataclass(frozen=True)
class Correlation:
    """Spearman's rank correlation of a metric with grasp success; nan where it is not defined.

    Intervals resample translators (all columns of one are drawn together): over a handful of them they are rough, and
    over one there is none (nan).
    """

    metric: str
    overall: Estimate  # over all points
    within_columns: Estimate  # mean over columns: a camera that is harder for all does not count
    within_points: Estimate  # mean over points of that over scenes: where the metric says so, do grasps fail?


def correlate(points: Sequence[Point], seed: int) -> list[Correlation]:
    """A correlation for each metric, the strongest over all points first; the same measurement counts once."""
    points = list({point.fingerprint: point for point in points}.values())
    metrics = list(points[0].measures)
    translators = sorted({point.translator for point in points})
    members = [[i for i, point in enumerate(points) if point.translator == each] for each in translators]
    statistics = _Statistics(points, metrics)

    def resampled(drawn: tuple[int, ...]) -> np.ndarray:
        return statistics(np.concatenate([members[cluster] for cluster in drawn]))

    low, high = over_clusters(resampled, len(translators), seed)
    value = statistics(np.arange(len(points)))
    found = [
        Correlation(metric, *(Estimate(float(value[s, m]), float(low[s, m]), float(high[s, m])) for s in range(3)))
        for m, metric in enumerate(metrics)
    ]
    return sorted(found, key=lambda each: -np.nan_to_num(abs(each.overall.value), nan=-1))


class _Statistics:
    """The three correlations of each metric over some of the points, [3, M]."""

    def __init__(self, points: Sequence[Point], metrics: list[str]) -> None:
        self._success = np.array([point.success.mean() for point in points])
        self._values = np.array([[point.value(metric) for metric in metrics] for point in points])
        self._columns = np.array([point.column for point in points])
        self._by_scene = np.array([[_over_scenes(point, metric) for metric in metrics] for point in points])

    def __call__(self, some: np.ndarray) -> np.ndarray:
        columns = [some[self._columns[some] == column] for column in np.unique(self._columns[some])]
        return np.stack(
            [
                self._over_points(some),
                _mean(np.stack([self._over_points(column) for column in columns])),
                _mean(self._by_scene[some]),
            ]
        )

    def _over_points(self, some: np.ndarray) -> np.ndarray:
        return np.array([spearman(values, self._success[some]) for values in self._values[some].T])


def correlated(values: Sequence[np.ndarray], success: Sequence[np.ndarray], seed: int) -> Estimate:
    """Spearman's ρ over the members of all clusters, arrays of one length in each; resamples draw whole clusters."""

    def statistic(drawn: Sequence[int]) -> np.ndarray:
        return np.array(spearman(*(np.concatenate([each[k] for k in drawn]) for each in (values, success))))

    low, high = over_clusters(statistic, len(values), seed)
    return Estimate(float(statistic(range(len(values)))), float(low), float(high))


def spearman(values: np.ndarray, success: np.ndarray) -> float:
    """Spearman's ρ over where both are known; nan where either is the same everywhere, or of fewer than FEWEST."""
    known = ~np.isnan(values)
    if known.sum() < FEWEST:
        return float("nan")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConstantInputWarning)
        return float(spearmanr(values[known], success[known]).statistic)


def _over_scenes(point: Point, metric: str) -> float:
    return spearman(point.by_scene(metric), point.success)


def _mean(values: np.ndarray) -> np.ndarray:
    """Over the first axis, of what is defined."""
    count = (~np.isnan(values)).sum(0)
    return np.divide(np.nansum(values, 0), count, out=np.full(values.shape[1:], np.nan), where=count > 0)
