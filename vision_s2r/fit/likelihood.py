"""How likely residuals are: Student's t, so that a few instants which no simulator gets right decide nothing.

An impact a thousandth of a second early is a large error of one sample. With NU degrees of freedom such a sample counts
with the logarithm of its size, and noise that is Gaussian loses next to nothing.
"""

import math

import numba
import numpy as np

NU = 4.0
# Scale² of the t distribution that fits Gaussian noise of variance 1 best.
GAUSSIAN = 0.7405
_ROUNDS = 6


@numba.njit(nogil=True, cache=True, error_model="numpy")
def profile(residuals: np.ndarray, weight: np.ndarray, floor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The likeliest scale² [C, channels], no smaller than its floor, and with it the cost [C, channels], nats.

    residuals [C, E, T, channels], weight [E, T] 0 or 1, floor [channels]: scale² of noise alone. Cost is the negative
    log-likelihood, relative to a residual of zero at the floor.
    """
    candidates, episodes, samples, channels = residuals.shape
    scales, costs = np.empty((candidates, channels)), np.empty((candidates, channels))
    count = weight.sum()
    for c in range(candidates):
        for k in range(channels):
            total = 0.0  # mean logarithm: a start that outliers do not move
            for e in range(episodes):
                for t in range(samples):
                    if weight[e, t] > 0:
                        total += math.log(residuals[c, e, t, k] ** 2 + 0.01 * floor[k])
            scale = max(math.exp(total / count) * 2.5, floor[k])
            for _ in range(_ROUNDS):
                total = 0.0
                for e in range(episodes):
                    for t in range(samples):
                        if weight[e, t] > 0:
                            square = residuals[c, e, t, k] ** 2
                            total += (NU + 1) * square / (NU + square / scale)
                scale = max(total / count, floor[k])
            cost = 0.0
            for e in range(episodes):
                for t in range(samples):
                    if weight[e, t] > 0:
                        cost += math.log1p(residuals[c, e, t, k] ** 2 / (NU * scale))
            scales[c, k] = scale
            costs[c, k] = 0.5 * (NU + 1) * cost + 0.5 * count * math.log(scale / floor[k])
    return scales, costs


@numba.njit(nogil=True, cache=True, error_model="numpy")
def normal_equations(
    residuals: np.ndarray, slopes: np.ndarray, factor: np.ndarray, label: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Curvature [count, D, D] and slope [count, D] of the log-likelihood, of the samples with each label.

    residuals [E, T, channels] and their slopes [D, E, T, channels]; factor [E, T, channels] by which each sample
    counts; label [E, T] from 0 to count - 1, or -1. (No BLAS: its threads and those of the search would wait for each
    other.)
    """
    size = len(slopes)
    curvature, slope = np.zeros((count, size, size)), np.zeros((count, size))
    row = np.empty(size)
    episodes, samples, channels = residuals.shape
    for e in range(episodes):
        for t in range(samples):
            k = label[e, t]
            if k < 0:
                continue
            for c in range(channels):
                weight, value = factor[e, t, c], residuals[e, t, c]
                for i in range(size):
                    row[i] = slopes[i, e, t, c]
                for i in range(size):
                    weighted = weight * row[i]
                    slope[k, i] -= weighted * value
                    for j in range(i + 1):
                        curvature[k, i, j] += weighted * row[j]
    for k in range(count):
        for i in range(size):
            for j in range(i):
                curvature[k, j, i] = curvature[k, i, j]
    return curvature, slope


def block_loglik(residuals: np.ndarray, label: np.ndarray, count: int, floor: np.ndarray) -> np.ndarray:
    """Log-likelihood [count, channels] of the samples with each label, each label's scale² at its best above the floor.

    residuals [E, T, channels], label [E, T] from 0 to count - 1, or -1.
    """
    inside = label >= 0
    of, values = label[inside], residuals[inside]
    size = np.maximum(np.bincount(of, minlength=count), 1)[:, None]

    def sums(each: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(of, column, count) for column in each.T], axis=1)

    squares = values**2
    scale = np.maximum(2.5 * np.exp(sums(np.log(squares + 0.01 * floor)) / size), floor)
    for _ in range(_ROUNDS):
        scale = np.maximum(sums((NU + 1) * squares / (NU + squares / scale[of])) / size, floor)
    return sums(log_density(values, scale[of]))


def influence(residuals: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Weight of each residual [..., channels] in least squares: 1/variance for small ones, less for large ones."""
    return (NU + 1) / (NU * scale + residuals**2)


def log_density(residuals: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Log-density [..., channels] of residuals under these scales² [..., channels]."""
    constant = math.lgamma((NU + 1) / 2) - math.lgamma(NU / 2) - 0.5 * math.log(NU * math.pi)
    return constant - 0.5 * np.log(scale) - 0.5 * (NU + 1) * np.log1p(residuals**2 / (NU * scale))
