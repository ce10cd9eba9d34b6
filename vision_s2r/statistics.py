"""Success and errors with their uncertainty: of one policy, of two on the same scenes, of segments or clusters.

Outcomes are arrays bool [S, N]: S training seeds, each on the same N scenes. Attempts in one scene depend on each
other (a hard scene is hard for every seed), as do those of one seed, so they are no S x N independent trials.
"""

import itertools
import math
import warnings
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import TypeVar

import numpy as np
from scipy.special import bdtr, stdtrit  # scipy.stats takes half a second to import

CONFIDENCE = 0.95
RESAMPLES = 10_000
FEWER_RESAMPLES = 4000  # where a search asks thousands of times
CLUSTER_RESAMPLES = 1000  # of whatever statistic, so that each may take a while
CHUNK = 500  # resamples drawn at a time: bounds the memory for many scenes
P = TypeVar("P", bound=Hashable)


@dataclass(frozen=True)
class Estimate:
    """A value and its 95 % interval. Of ratios: inf over no success, nan where neither row had any."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Bootstrap:
    """Resamples of the same scenes for every cell of a table, so that differences between cells are paired.

    Each resample draws N scenes with replacement and, where there is more than one, S training seeds with
    replacement, independently; an attempt counts as often as its scene times its seed (the pigeonhole bootstrap of
    crossed factors: Owen 2007, Ann. Appl. Stat. 1(2), doi:10.1214/07-AOAS122). Intervals are percentiles. With the
    few seeds that anybody trains, the spread between them is known poorly and drawn too narrow by about
    (S - 1) / S: an interval speaks of these scenes more than of trainings to come.
    """

    scenes: int
    seed: int = 0

    @cached_property
    def _scene_counts(self) -> np.ndarray:
        """float32 [RESAMPLES, N]: how often a resample holds a scene."""
        rng = np.random.default_rng([self.seed, 0])
        counts = np.empty((RESAMPLES, self.scenes), dtype=np.float32)
        for start in range(0, RESAMPLES, CHUNK):
            drawn = rng.integers(self.scenes, size=(CHUNK, self.scenes))
            flat = drawn + self.scenes * np.arange(CHUNK)[:, None]
            counts[start : start + CHUNK] = np.bincount(flat.ravel(), minlength=flat.size).reshape(flat.shape)
        return counts

    def _seed_counts(self, seeds: int) -> np.ndarray:
        """[RESAMPLES, S]: how often a resample holds a training seed; the same for all rows of S seeds."""
        rng = np.random.default_rng([self.seed, seeds])
        return rng.multinomial(seeds, np.full(seeds, 1 / seeds), size=RESAMPLES)

    def means(self, outcomes: np.ndarray) -> np.ndarray:
        """Success [RESAMPLES] of outcomes [S, N] in each resample."""
        by_seed = (self._scene_counts @ outcomes.T.astype(np.float32)).astype(float) / self.scenes  # exact: whole
        return (by_seed * self._seed_counts(len(outcomes))).sum(axis=1) / len(outcomes)

    def difference(self, first: np.ndarray, second: np.ndarray) -> Estimate:
        """Success of `first` minus that of `second`, [S, N] each, over the same scenes.

        Where both have the same number of seeds, the k-th of both are drawn together.
        """
        value = float(first.mean() - second.mean())
        return _percentiles(value, self.means(first) - self.means(second))

    def ratio(self, first: np.ndarray, second: np.ndarray) -> Estimate:
        """Success of `first` over that of `second`, as `difference`; a resample without any may mean any ratio."""
        with np.errstate(divide="ignore", invalid="ignore"):
            value = np.divide(first.mean(), second.mean())
            resampled = self.means(first) / self.means(second)
        low = _percentiles(0, np.nan_to_num(resampled, nan=0, posinf=np.inf)).low
        high = _percentiles(0, np.nan_to_num(resampled, nan=np.inf, posinf=np.inf)).high
        return Estimate(float(value), low, high)

    def success(self, outcomes: np.ndarray) -> Estimate:
        """Share of successes in outcomes [S, N], or in shares of several attempts in each scene.

        One seed and attempt: Wilson's interval. Several: the bootstrap's, or, where all attempts ended alike and no
        resample can differ, Wilson's with one trial a scene.
        """
        value = float(outcomes.mean())
        if 0 < value < 1 and (len(outcomes) > 1 or not np.isin(outcomes, (0, 1)).all()):
            return _percentiles(value, self.means(outcomes))
        return wilson(round(value * self.scenes), self.scenes)


def wilson(successes: int, attempts: int) -> Estimate:
    """Share of successes of independent attempts, with Wilson's score interval."""
    from statsmodels.stats.proportion import proportion_confint  # here: it takes half a second

    low, high = proportion_confint(successes, attempts, alpha=1 - CONFIDENCE, method="wilson")
    share = successes / attempts
    return Estimate(share, min(float(low), share), max(float(high), share))  # rounding puts 0 below its own interval


def over_trainings(values: np.ndarray) -> Estimate:
    """Mean of a number a training [S], with Student's t interval; of one training nothing is known: nan."""
    mean, count = float(values.mean()), len(values)
    if count < 2:
        return Estimate(mean, math.nan, math.nan)
    reach = float(stdtrit(count - 1, (1 + CONFIDENCE) / 2) * values.std(ddof=1) / math.sqrt(count))
    return Estimate(mean, mean - reach, mean + reach)


def agree(one: Estimate, other: Estimate) -> bool:
    """Whether two values are no further apart than their intervals reach towards each other (root of squares)."""
    low, high = sorted((one, other), key=lambda each: each.value)
    return high.value - low.value <= math.hypot(low.high - low.value, high.value - high.low)


def mcnemar(first: np.ndarray, second: np.ndarray) -> float:
    """Exact two-sided p-value that two policies succeed equally often, from outcomes [N] on the same scenes."""
    only_first, only_second = int((first & ~second).sum()), int((~first & second).sum())
    if only_first + only_second == 0:
        return 1.0
    return min(1.0, 2 * float(bdtr(min(only_first, only_second), only_first + only_second, 0.5)))


def _percentiles(value: float, resampled: np.ndarray) -> Estimate:
    tail = (1 - CONFIDENCE) / 2
    # No interpolation: resampled ratios may be infinite.
    low, high = np.quantile(resampled, [tail, 1 - tail], method="inverted_cdf")
    return Estimate(value, float(low), float(high))


def over_clusters(
    statistic: Callable[[tuple[int, ...]], np.ndarray], clusters: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the 95 % bootstrap interval of a statistic of whole clusters drawn with replacement; nan of one cluster.

    `statistic` is given which clusters a resample holds, in order, and answers with an array, nan where it is not
    defined; of few clusters many resamples are alike, and it is asked once.
    """
    draws = np.sort(np.random.default_rng(seed).integers(clusters, size=(CLUSTER_RESAMPLES, clusters)), axis=1)
    asked = cache(statistic)
    resampled = np.stack([asked(tuple(draw)) for draw in draws.tolist()])
    if clusters < 2:
        nothing = np.full(resampled.shape[1:], np.nan)
        return nothing, nothing
    tail = (1 - CONFIDENCE) / 2
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # nowhere defined: nan, as it should be
        low, high = np.nanquantile(resampled, [tail, 1 - tail], axis=0)
    return low, high


def shapley(players: Sequence[P], worth: Callable[[frozenset[P]], np.ndarray]) -> dict[P, np.ndarray]:
    """The part [N] of each player in what all of them are worth [N] more than none (Shapley 1953).

    `worth` is asked once for every subset: 2^n of them.
    """
    of = {
        frozenset(subset): np.asarray(worth(frozenset(subset)), dtype=float)
        for size in range(len(players) + 1)
        for subset in itertools.combinations(players, size)
    }
    parts = {player: np.zeros_like(of[frozenset()]) for player in players}
    for subset, here in of.items():
        for player in subset:
            others = len(subset) - 1
            weight = math.factorial(others) * math.factorial(len(players) - len(subset)) / math.factorial(len(players))
            parts[player] += weight * (here - of[subset - {player}])
    return parts


def lower_bound(gains: np.ndarray, level: float, seed: int) -> float:
    """Lower confidence bound (at `level`, such as 0.999) of the sum of independent gains [n], by bootstrap."""
    return float(np.quantile(_counts(len(gains), seed) @ gains, 1 - level))


def interval(statistic: Callable[[np.ndarray], np.ndarray], segments: int, seed: int) -> tuple[float, float]:
    """95 % bootstrap interval of a statistic of resampled segments.

    `statistic` is given how often each resample holds each segment [R, segments] and answers [R].
    """
    return _middle(statistic(_counts(segments, seed)))


def interval_of_groups(
    statistic: Callable[[list[np.ndarray]], np.ndarray], groups: Sequence[int], seed: int
) -> tuple[float, float]:
    """The same of segments in groups of these sizes, each of which is resampled in itself."""
    return _middle(statistic([_counts(size, seed + k) for k, size in enumerate(groups)]))


def _middle(values: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(values[np.isfinite(values)], [0.025, 0.975]) if np.isfinite(values).any() else (0.0, 1.0)
    return float(low), float(high)


@lru_cache(maxsize=4)
def _counts(segments: int, seed: int) -> np.ndarray:
    """How often each resample holds each segment [R, segments]; drawn once: a search asks for the same many times."""
    counts = np.random.default_rng(seed).multinomial(segments, np.full(segments, 1 / segments), FEWER_RESAMPLES)
    counts.setflags(write=False)
    return counts
