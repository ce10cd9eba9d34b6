"""Where the gap lies: which samples hold more of it than their number."""

from typing import Any

import numpy as np

from vision_s2r.fit.case import Axis, Samples
from vision_s2r.statistics import interval

LIFT = 1.3  # a place is worth naming where it holds so many times its share of the samples
LEAST = 0.05  # … and this share of the gap
MOST = 8  # places named


def where(samples: Samples, seed: int) -> list[dict[str, Any]]:
    """The places that hold more of the gap than of the samples, the most telling first, as the report has them."""
    found = [place for axis in samples.axes for place in _telling(samples, axis, seed)]
    return [place for _, place in sorted(found, key=lambda each: -each[0])[:MOST]]


def _telling(samples: Samples, axis: Axis, seed: int) -> list[tuple[float, dict[str, Any]]]:
    over, count = _sums(samples, axis)
    usual = count.sum(axis=0) / max(count.sum(), 1) if axis.usual is None else np.array(axis.usual)
    # Where a division of its own kind of samples sees little of the gap, its places say little.
    seen = 1.0 if axis.usual is None else _seen(samples, over, count)
    found = []
    for k, label in enumerate(axis.labels):

        def statistic(counts: np.ndarray, k: int = k) -> np.ndarray:
            whole = counts @ over.sum(axis=1)
            return np.divide(counts @ over[:, k], whole, out=np.zeros(len(counts)), where=whole > 0)

        share = float(statistic(np.ones((1, len(over))))[0])
        of_samples = usual[k]
        low, high = interval(statistic, len(over), seed)
        if share > LEAST and low > of_samples * LIFT:
            place = {
                "axis": axis.name,
                "at": label,
                "share": min(share, 1.0),
                "ci": [max(low, 0.0), min(high, 1.0)],
                "samples": float(of_samples),
            }
            found.append((seen * share * np.log(share / of_samples), place))
    return sorted(found, key=lambda each: -each[0])[:2]


def _seen(samples: Samples, over: np.ndarray, count: np.ndarray) -> float:
    """The mean gap of an axis' samples, as a share of that of the axis that sees most of it; at most 1."""
    most = max(
        (float(sums.sum() / max(number.sum(), 1)) for sums, number in (_sums(samples, axis) for axis in samples.axes)),
        default=0.0,
    )
    return min(max(float(over.sum() / max(count.sum(), 1)) / most, 0.0), 1.0) if most > 0 else 0.0


def _sums(samples: Samples, axis: Axis) -> tuple[np.ndarray, np.ndarray]:
    """Squared error over the floor, and number of samples, by segment and bin [segments, bins]."""
    segments = int(samples.segment.max()) + 1 if len(samples.segment) else 0
    inside = axis.bins >= 0
    flat = samples.segment[inside] * len(axis.labels) + axis.bins[inside]
    size = segments * len(axis.labels)
    over = np.bincount(flat, (samples.error - samples.floor)[inside], size)
    return over.reshape(segments, -1), np.bincount(flat, minlength=size).reshape(segments, -1)
