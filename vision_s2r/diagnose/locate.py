"""Where the gap lies: which samples hold more of it than their number.

The axis that tells most comes first: that along which the gap of some segments says best where that of others lies.
What a scene happens to have at one place, others have not.
"""

from typing import Any

import numpy as np

from vision_s2r.fit.case import Axis, Samples
from vision_s2r.statistics import interval

LIFT = 1.3  # a place is worth naming where it holds so many times its share of the samples
LEAST = 0.05  # … and this share of the gap
MOST = 8  # places named
SEEN = 0.05  # of the mean gap: as little is expected of a bin at least, whatever half of the segments has there


def where(samples: Samples, seed: int, lift: float = LIFT) -> list[dict[str, Any]]:
    """The places that hold more of the gap than of the samples, surely `lift` times as much.

    Those of the axis that tells most come first.
    """
    found = [(_tells(samples, axis), axis) for axis in samples.axes]
    ordered = [axis for _, axis in sorted(found, key=lambda each: -each[0])]
    return [place for axis in ordered for place in _telling(samples, axis, seed, lift)][:MOST]


def _tells(samples: Samples, axis: Axis) -> float:
    """By how much (nats) one half of the segments says where the gap of the other half lies along an axis.

    Halves have the mean gap of each bin in common, not how many samples it has.
    """
    over, count = _sums(samples, axis)
    halves = [(_shares(over[k::2].sum(axis=0)), _usual(count[k::2].sum(axis=0), axis)) for k in range(2)]
    told = 0.0
    for (here, usual), (there, usual_there) in (halves, halves[::-1]):
        lift = np.divide(here, usual, out=np.ones_like(here), where=usual > 0).clip(SEEN)
        expected = _shares(usual_there * lift)
        some = (usual_there > 0) & (there > 0)
        told += float(np.sum(there[some] * np.log(expected[some] / usual_there[some]))) / 2
    # Where a division of its own kind of samples sees little of the gap, its places say little.
    return told * (1.0 if axis.usual is None else _seen(samples, over, count))


def _shares(sums: np.ndarray) -> np.ndarray:
    """Of what is there; none of less than nothing."""
    return sums.clip(0) / max(float(sums.clip(0).sum()), 1e-12)


def _usual(count: np.ndarray, axis: Axis) -> np.ndarray:
    """The share [..., bins] of the samples, or of what is usual, in each bin; of each of several counts."""
    if axis.usual is not None:
        return np.broadcast_to(np.array(axis.usual), count.shape)
    return count / np.maximum(count.sum(axis=-1, keepdims=True), 1)


def _telling(samples: Samples, axis: Axis, seed: int, lift: float) -> list[dict[str, Any]]:
    """At most two places of an axis, the most telling first."""
    over, count = _sums(samples, axis)
    usual = _usual(count.sum(axis=0), axis)
    found = []
    for k, label in enumerate(axis.labels):

        def share_of(counts: np.ndarray, k: int = k) -> np.ndarray:
            whole = counts @ over.sum(axis=1)
            # A draw without any of the gap says nothing of where it lies.
            return np.divide(counts @ over[:, k], whole, out=np.full(len(counts), np.nan), where=whole > 0)

        def lift_of(counts: np.ndarray, k: int = k) -> np.ndarray:
            drawn = _usual(counts @ count, axis)[:, k]
            return np.divide(share_of(counts, k), drawn, out=np.zeros(len(counts)), where=drawn > 0)

        share = float(share_of(np.ones((1, len(over))))[0])
        if not share > max(LEAST, usual[k]) or interval(lift_of, len(over), seed)[0] <= lift:  # of no gap: nan
            continue
        low, high = (min(max(end, 0.0), 1.0) for end in interval(share_of, len(over), seed))
        place = {
            "axis": axis.name,
            "at": label,
            "share": min(share, 1.0),
            "ci": [low, high],
            "samples": float(usual[k]),
        }
        found.append((share * np.log(share / usual[k]), place))
    return [place for _, place in sorted(found, key=lambda each: -each[0])[:2]]


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
