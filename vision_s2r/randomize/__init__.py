"""Randomization of effects of any source: ranges or a posterior in, values of the effects' parameters out.

Or a policy's performance in, and ranges that widen with it.
"""

from vision_s2r.randomize.adr import AdrConfig, AdrSample, AutomaticDomainRandomization, Dimension, dimensions
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
    "AdrConfig",
    "AdrSample",
    "AutomaticDomainRandomization",
    "Box",
    "Dimension",
    "Distribution",
    "EffectRange",
    "Posterior",
    "Range",
    "Samples",
    "Values",
    "dimensions",
    "effect_ranges",
    "load_distribution",
    "sample_at",
]
