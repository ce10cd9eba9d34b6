"""How much of what may come (a target: reality, another range) lies within what is drawn from (a cover).

Coverage is asked in the effects that the target names; equal shares of a range matter equally on its parameter's scale.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.stats import binomtest

from vision_s2r.effects import Registry
from vision_s2r.randomize.distribution import Box, Distribution, Samples
from vision_s2r.randomize.ranges import Range, Scale

CONFIDENCE = 0.95


class Cover(Protocol):
    """What has ranges: a box, or an automatic randomization as it is now."""

    @property
    def registry(self) -> Registry[Any]:
        """The effects that it knows."""

    def support(self, effect: str) -> list[dict[str, Range]]:
        """Where its draws lie, by parameter: with the effect on, and with it off."""


@dataclass(frozen=True)
class Coverage:
    """Of `count` samples of the target, `covered` lie within the cover; the share, and its 95 % interval (Wilson)."""

    covered: int
    count: int
    share: float
    low: float
    high: float


def covered(cover: Range, target: Range, scale: Scale = "linear") -> float:
    """The share of `target` within `cover`; of a point, 1 or 0."""
    low, high = max(cover.low, target.low), min(cover.high, target.high)
    if target.low == target.high:
        return float(low <= high)
    return target.position(high, scale) - target.position(low, scale) if low < high else 0.0


def covered_of_box(cover: Cover, target: Box) -> float:
    """The probability that a draw of `target` lies within `cover`, exactly: the product over effects and parameters.

    Raises UserError for an effect of the target whose value in the cover is not known.
    """
    share = 1.0
    for name, drawn in target.ranges.items():
        off = {key: Range(value, value) for key, value in target.absent(name).items()}
        with_effect = drawn.probability * _covered_effect(cover, name, drawn.ranges) if drawn.probability > 0 else 0.0
        without = (1 - drawn.probability) * _covered_effect(cover, name, off) if drawn.probability < 1 else 0.0
        share *= with_effect + without
    return share


def _covered_effect(cover: Cover, name: str, target: Mapping[str, Range]) -> float:
    """The share of these ranges of an effect's parameters; on and off overlap nowhere but in a point."""
    effect = cover.registry[name]
    return max(
        math.prod(covered(part[key], target[key], effect.parameter(key).scale) for key in target.keys() & part.keys())
        for part in cover.support(name)
    )


def covers(cover: Cover, samples: Samples) -> np.ndarray:
    """Which samples [N] lie within `cover` in all their parameters; UserError as `covered_of_box` raises it."""
    inside: Any = True
    for name, given in samples.items():
        parts = [
            np.logical_and.reduce([part[key].holds(given[key]) for key in given.keys() & part.keys()])
            for part in cover.support(name)
        ]
        inside = inside & np.logical_or.reduce(parts)
    return np.asarray(inside)


def sampled_coverage(cover: Cover, target: Distribution, count: int, rng: np.random.Generator) -> Coverage:
    """The share of `count` (1 or more) draws of any distribution within `cover`; UserError as `covers` raises it."""
    found = int(covers(cover, target.sample(count, rng)).sum())
    interval = binomtest(found, count).proportion_ci(CONFIDENCE, method="wilson")
    return Coverage(found, count, found / count, float(interval.low), float(interval.high))
