"""Growing an effect to a severity, and what of it no mixture of other changes imitates."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from vision_s2r.gapbench.generate.base import Redraw

T = TypeVar("T")


def of_severity(
    severity: Callable[[T], float],
    grow: Callable[[float], T],
    rng: np.random.Generator,
    bounds: tuple[float, float],
    least: float = 0.0,
) -> T:
    """The member of a family, of an intensity between `least` and 1, whose severity is one drawn within `bounds`.

    Drawn uniformly in its logarithm. Raises Redraw where no member is so severe, or so mild.
    """
    target = np.exp(rng.uniform(*np.log(bounds)))
    low, high, x = np.log(max(least, 1e-6)), 0.0, 0.0
    grown = grow(1.0)
    for _ in range(15):
        ratio = severity(grown) / target
        if x == 0 and ratio < 1:
            raise Redraw
        if abs(ratio - 1) < 0.1:
            return grown
        low, high = (x, high) if ratio < 1 else (low, x)
        x -= np.log(max(ratio, 1e-12))  # as if the gap grew in proportion
        if not low < x < high:
            x = (low + high) / 2
        grown = grow(np.exp(x))
    raise Redraw


def left_over(change: np.ndarray, others: np.ndarray) -> float:
    """Root mean square of a change [N] less its projection on others [N, K]."""
    columns = others / np.maximum(np.linalg.norm(others, axis=0), 1e-12)
    weights = np.linalg.lstsq(columns, change, rcond=1e-6)[0]
    return float(np.sqrt(np.mean((change - columns @ weights) ** 2)))
