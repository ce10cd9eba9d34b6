"""Samples divided by a quantity, for saying where a gap lies."""

from itertools import pairwise

import numpy as np

Bins = tuple[tuple[str, ...], np.ndarray]  # labels, and the bin of each value: -1 where it has none


def evenly(values: np.ndarray, count: int, words: str) -> Bins:
    """Bins of one width; `words` is their label, with {low} and {high}. NaN is in none."""
    return _bins(values, np.linspace(np.nanmin(values), np.nanmax(values), count + 1), words)


def by_rank(values: np.ndarray, count: int, words: str) -> Bins:
    """Bins of as many values; else as `evenly`."""
    some = np.isfinite(values).any()
    return _bins(values, np.nanquantile(values, np.linspace(0, 1, count + 1)) if some else np.zeros(1), words)


def _bins(values: np.ndarray, edges: np.ndarray, words: str) -> Bins:
    edges = np.unique(edges)
    ends = list(pairwise(edges)) or [(edges[0], edges[0])]
    labels = tuple(words.format(low=low, high=high) for low, high in ends)
    bins = np.clip(np.searchsorted(edges, np.nan_to_num(values), side="right") - 1, 0, len(labels) - 1)
    return labels, np.where(np.isnan(values), -1, bins)
