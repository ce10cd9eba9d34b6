"""Randomisation of effects of any source: ranges or a posterior in, values of the effects' parameters out.

Or a policy's performance in, and ranges that widen with it.
"""

from vision_s2r.randomize.automatic import AutomaticConfig, AutomaticRandomisation, Dimension, Draw, dimensions
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
    "AutomaticConfig",
    "AutomaticRandomisation",
    "Box",
    "Dimension",
    "Distribution",
    "Draw",
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
