"""Resampling of what may be taken as independent: blocks of a log-likelihood, episodes or frames of an error."""

from collections.abc import Callable
from functools import lru_cache
from typing import TypeAlias

import numpy as np

RESAMPLES = 4000
Interval: TypeAlias = tuple[float, float]


def lower_bound(gains: np.ndarray, level: float, seed: int) -> float:
    """Lower confidence bound (at `level`, such as 0.999) of the sum of independent gains [n], by bootstrap."""
    return float(np.quantile(_counts(len(gains), seed) @ gains, 1 - level))


def interval(statistic: Callable[[np.ndarray], np.ndarray], units: int, seed: int) -> Interval:
    """95 % bootstrap interval of a statistic of resampled units.

    `statistic` is given how often each resample holds each unit [R, units] and answers [R].
    """
    values = statistic(_counts(units, seed))
    low, high = np.quantile(values[np.isfinite(values)], [0.025, 0.975]) if np.isfinite(values).any() else (0.0, 1.0)
    return float(low), float(high)


@lru_cache(maxsize=4)
def _counts(units: int, seed: int) -> np.ndarray:
    """How often each resample holds each unit [R, units]; drawn once, since a search asks for the same many times."""
    counts = np.random.default_rng(seed).multinomial(units, np.full(units, 1 / units), RESAMPLES)
    counts.setflags(write=False)
    return counts
