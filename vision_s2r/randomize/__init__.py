"""Randomisation of effects of any source: ranges or a posterior in, values of the effects' parameters out."""

from vision_s2r.randomize.distribution import (
    Box,
    Distribution,
    Posterior,
    Samples,
    Values,
    load_distribution,
    sample_at,
)
from vision_s2r.randomize.ranges import EffectRange, Range, effect_ranges

__all__ = [
    "Box",
    "Distribution",
    "EffectRange",
    "Posterior",
    "Range",
    "Samples",
    "Values",
    "effect_ranges",
    "load_distribution",
    "sample_at",
]
