"""Randomisation of effects of any source: ranges in, values of their parameters out."""

from vision_s2r.randomize.ranges import EffectRange, Range, effect_ranges

__all__ = ["EffectRange", "Range", "effect_ranges"]
