"""Resampling of what may be taken as independent: blocks of a log-likelihood, episodes or frames of an error."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

RESAMPLES = 4000
Interval: TypeAlias = tuple[float, float]


def lower_bound(gains: np.ndarray, level: float, seed: int) -> float:
    """Lower confidence bound (at `level`, such as 0.999) of the sum of independent gains [n], by bootstrap."""
    sums = np.random.default_rng(seed).multinomial(len(gains), np.full(len(gains), 1 / len(gains)), RESAMPLES) @ gains
    return float(np.quantile(sums, 1 - level))


def interval(statistic: Callable[[np.ndarray], np.ndarray], units: int, seed: int) -> Interval:
    """95 % bootstrap interval of a statistic of resampled units.

    `statistic` is given how often each resample holds each unit [R, units] and answers [R].
    """
    counts = np.random.default_rng(seed).multinomial(units, np.full(units, 1 / units), RESAMPLES)
    values = statistic(counts)
    low, high = np.quantile(values[np.isfinite(values)], [0.025, 0.975]) if np.isfinite(values).any() else (0.0, 1.0)
    return float(low), float(high)
