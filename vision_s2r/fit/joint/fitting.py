"""Maximum likelihood by Levenberg and Marquardt: derivatives by differences, all of them one batch of machines.

Each channel (position, velocity) has a scale of its own, as large as its residual and no smaller than its floor; what
is minimized is the negative log-likelihood with the scales at their best. (Marquardt, SIAM J. 11, 1963; large residuals
by iteratively reweighted least squares.)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.joint.likelihood import influence, normal_equations, profile
from vision_s2r.fit.joint.observer import Observer
from vision_s2r.fit.joint.space import Space

DAMPINGS = np.array([0.03, 1.0, 100.0, 1e4])  # tried at once, times the last that was best
LEAST_GAIN = 0.02  # nats that another iteration must bring


@dataclass(frozen=True)
class Data:
    """What is fitted: samples, and how much each counts."""

    episodes: tuple[int, ...]
    weight: np.ndarray  # [E, T] 1 where a sample counts, else 0
    floor: np.ndarray  # [channels] scale² below which none goes
    temper: np.ndarray  # [channels] effective samples a sample


@dataclass(frozen=True)
class Fitted:
    """The end of a fit."""

    point: np.ndarray
    cost: float  # negative log-likelihood and prior, nats
    scale: np.ndarray  # [channels] squared


def costs(observer: Observer, space: Space, data: Data, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Negative log-likelihood [C] (nats) of points [C, D], and scales² [C, channels]."""
    return _costs(observer.residuals(space, points, data.episodes), data)


def _costs(residuals: np.ndarray, data: Data) -> tuple[np.ndarray, np.ndarray]:
    scale, cost = profile(residuals, data.weight, data.floor)
    return cost @ data.temper, scale


def minimize(
    observer: Observer, space: Space, data: Data, start: np.ndarray, iterations: int, strides: Sequence[float] = (1.0,)
) -> Fitted:
    """From one start to the nearest optimum, or as far as `iterations`, 1 or more, go with each stride.

    A stride multiplies the steps of the differences: long ones look over the small ripples that impacts leave.
    """
    best = Fitted(start, np.inf, np.ones(observer.channels))
    for stride in strides:
        found = _descend(observer, space, data, best.point, start, stride, iterations)
        if found.cost < best.cost:
            best = found
    return best


def _descend(
    observer: Observer, space: Space, data: Data, point: np.ndarray, centre: np.ndarray, stride: float, iterations: int
) -> Fitted:
    damping, left = 1e-3, observer.residuals(space, point[None], data.episodes)
    values, scales = _costs(left, data)
    now = Fitted(point, float(values[0]) + _prior(point, centre, space), scales[0])
    for _ in range(iterations):
        points, steps = space.differences(now.point, stride)
        around = observer.residuals(space, points[1:], data.episodes)
        curvature, slope = _normal(np.concatenate([left, around]), steps, now.scale, data)
        curvature[np.diag_indices(space.size)] += space.prior**-2.0
        slope += (centre - now.point) * space.prior**-2.0
        tried = trials(now.point, curvature, slope, damping * DAMPINGS, space)
        residuals = observer.residuals(space, tried, data.episodes)
        values, scales = _costs(residuals, data)
        values = values + np.array([_prior(trial, centre, space) for trial in tried])
        k = int(np.argmin(values))
        gained = now.cost - float(values[k])
        if not gained > 0:
            break
        now, left = Fitted(tried[k], float(values[k]), scales[k]), residuals[k : k + 1]
        damping = float(np.clip(damping * DAMPINGS[k], 1e-9, 1e4))
        if gained < LEAST_GAIN:
            break
    return now


def _prior(point: np.ndarray, centre: np.ndarray, space: Space) -> float:
    return 0.5 * float((((point - centre) / space.prior) ** 2).sum())


def _normal(residuals: np.ndarray, steps: np.ndarray, scale: np.ndarray, data: Data) -> tuple[np.ndarray, np.ndarray]:
    """Curvature [D, D] and slope [D] of the log-likelihood, from residuals at a point and one step along each axis."""
    factor = influence(residuals[0], scale) * data.temper
    label = np.where(data.weight > 0, 0, -1)
    curvature, slope = normal_equations(residuals, steps, factor, label, 1)
    return curvature[0], slope[0]


def trials(
    point: np.ndarray, curvature: np.ndarray, slope: np.ndarray, dampings: np.ndarray, space: Space
) -> np.ndarray:
    """Where each damping leads; coordinates that are pushed against a bound stay there."""
    out = []
    scale = np.sqrt(np.diag(curvature)) + 1e-300
    stuck = ((point <= space.low) & (slope < 0)) | ((point >= space.high) & (slope > 0)) | (scale < 1e-250)
    free = np.flatnonzero(~stuck)
    scaled = (curvature / scale / scale[:, None])[np.ix_(free, free)]
    for damping in dampings:
        step = np.zeros(len(point))
        solved = np.linalg.lstsq(scaled + damping * np.eye(len(free)), (slope / scale)[free], rcond=1e-12)[0]
        step[free] = solved / scale[free]
        out.append(np.clip(point + step, space.low, space.high))
    return np.array(out)
