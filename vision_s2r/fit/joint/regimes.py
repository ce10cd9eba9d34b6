"""How far a value hangs on which part of the motion tells it.

Where a simulator lacks something, slow samples ask for another value than fast ones, loaded ones for another than idle
ones; and another motion, which has more of the ones than of the others, for another than this. The sandwich says how
far off the mean of all regimes is. This says how far they lie apart: their scores are the inside of a sandwich of their
own (clusters, Liang and Zeger, Biometrika 1986), times their number, less what chance makes of it.
"""

from collections.abc import Sequence

import numpy as np

from vision_s2r.fit.case import Axis
from vision_s2r.fit.joint.uncertainty import BlockScores, Linear, clustered

ALONG = ("velocity", "torque", "position", "time")  # in which motions differ from each other


def scatter(of: BlockScores, here: Linear, axes: Sequence[Axis], inside: np.ndarray) -> np.ndarray:
    """Variance [D] of coded parameters from regime to regime; 0 where they differ by no more than chance makes them.

    `axes` divide the samples that are `inside` [E, T].
    """
    found, chance = np.zeros(of.space.size), np.diag(clustered(of, of.slope))
    bins = np.full(inside.shape, -1)
    for axis in axes:
        bins[inside] = axis.bins
        labels = np.unique(axis.bins[axis.bins >= 0])
        if axis.name in ALONG and len(labels) > 1:
            regimes = clustered(of, np.array([here.slope(bins == label) for label in labels]))
            found += len(labels) * np.maximum(np.diag(regimes) - chance, 0.0)
    return found
