"""Maximum likelihood by damped Gauss-Newton: derivatives by differences, carried from step to step.

Each channel (position, velocity) has a scale of its own, as large as its residual and no smaller than its floor; what
is minimized is the negative log-likelihood with the scales at their best. (Large residuals by iteratively
reweighted least squares.)
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from vision_s2r.fit.coordinates import Coordinates
from vision_s2r.fit.gauss_newton import damped_step
from vision_s2r.fit.likelihood import influence, normal_equations, profile

FIRST = 1e-3  # damping to begin with …
LEAST, MOST = 1e-9, 1e4
TRIED = (0.03, 1.0, 100.0, 1e4)  # times the damping: steps that are tried, until one brings what is promised
SETTLED = 0.1  # nats: where a step by slopes that are found anew gains less, the next would gain next to nothing
ENOUGH = 0.5  # of what the linearization promises: a step that brings as much is taken, and slopes are carried on


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


S = TypeVar("S", bound=Coordinates)


class Residuals(ABC, Generic[S]):
    """What points of a space leave unexplained."""

    channels: int  # of the residuals

    @abstractmethod
    def residuals(self, space: S, points: np.ndarray, episodes: Sequence[int]) -> np.ndarray:
        """Measured less predicted [C, E, T, channels] of points [C, D]."""

    def slopes(
        self, space: S, point: np.ndarray, here: np.ndarray, episodes: Sequence[int], stride: float = 1.0
    ) -> np.ndarray:
        """Change [D, E, T, channels] of the residuals `here` at a point [D] with each coordinate.

        By differences, which are `stride` times as long as a coordinate's own.
        """
        return self.by_differences(space, point, here, episodes, stride, np.arange(space.size))

    def linearized(self, space: S, point: np.ndarray, episodes: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Residuals [E, T, channels] at a point [D], and their slopes [D, E, T, channels]."""
        here = self.residuals(space, point[None], episodes)[0]
        return here, self.slopes(space, point, here, episodes)

    def by_differences(
        self, space: S, point: np.ndarray, here: np.ndarray, episodes: Sequence[int], stride: float, which: np.ndarray
    ) -> np.ndarray:
        """`slopes` [K, E, T, channels] of these coordinates [K], which may be none."""
        if not len(which):
            return np.zeros((0, *here.shape))
        points, steps = space.differences(point, stride)
        around = self.residuals(space, points[1 + which], episodes)
        return (around - here) / steps[which, None, None, None]


def costs(observer: Residuals[S], space: S, data: Data, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Negative log-likelihood [C] (nats) of points [C, D], and scales² [C, channels]."""
    return _costs(observer.residuals(space, points, data.episodes), data)


def _costs(residuals: np.ndarray, data: Data) -> tuple[np.ndarray, np.ndarray]:
    scale, cost = profile(residuals, data.weight, data.floor)
    return cost @ data.temper, scale


def minimize(
    observer: Residuals[S], space: S, data: Data, start: np.ndarray, iterations: int, strides: Sequence[float] = (1.0,)
) -> Fitted:
    """From one start to the nearest optimum, or as far as `iterations`, 1 or more, go with each stride.

    A stride multiplies the steps of the differences: long ones look over the small ripples that impacts leave.
    """
    best = Fitted(start, np.inf, np.ones(observer.channels))
    for stride in strides:
        found = _Descent(observer, space, data, space.believed(start), stride).descend(best.point, iterations)
        if found.cost < best.cost:
            best = found
    return best


def _carried(slopes: np.ndarray, change: np.ndarray, moved: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Slopes [D, E, T, channels] that bear out what a step [D] changed [1, E, T, channels]; else as they were."""
    along = moved / unit**2 / float(((moved / unit) ** 2).sum())
    return slopes + along[:, None, None, None] * (change - np.tensordot(moved, slopes, 1))


@dataclass(frozen=True)
class _State:
    """A point of a descent, and what the observer leaves there."""

    point: np.ndarray
    cost: float
    scale: np.ndarray
    residuals: np.ndarray  # [1, E, T, channels]


@dataclass(frozen=True)
class _Descent(Generic[S]):
    """From one start, the differences being `stride` times as long as a coordinate's own."""

    observer: Residuals[S]
    space: S
    data: Data
    centre: np.ndarray  # of the prior
    stride: float

    def descend(self, point: np.ndarray, iterations: int) -> Fitted:
        """To the nearest optimum.

        Many machines take as long as one after another: steps are tried one by one. Slopes are carried from step to
        step (Broyden, Mathematics of Computation 19, 1965), and found anew where a step brings less than half of what
        they promise.
        """
        state, damping, slopes = self.at(point), FIRST, None
        for _ in range(iterations):
            fresh = slopes is None
            slopes = self.slopes(state) if slopes is None else slopes
            curvature, slope = self.equations(state, slopes)
            best, enough = state, False
            for factor in TRIED if fresh else TRIED[:1]:
                trial = self.step(state, damped_step(curvature, slope, damping * factor))
                moved = trial.point - state.point
                promised = float(moved @ slope - 0.5 * moved @ curvature @ moved)
                enough = state.cost - trial.cost >= ENOUGH * promised
                if trial.cost < best.cost:
                    best, chosen = trial, damping * factor
                if enough:
                    break
            gained = state.cost - best.cost
            if gained > 0:
                moved, damping = best.point - state.point, float(np.clip(chosen, LEAST, MOST))
                slopes = _carried(slopes, best.residuals - state.residuals, moved, self.space.step)
                state = best
            if fresh and gained < SETTLED:
                break
            if not fresh and (not enough or gained < SETTLED):
                slopes = None  # at an optimum by slopes of elsewhere there need be none
        return Fitted(state.point, state.cost, state.scale)

    def at(self, point: np.ndarray) -> _State:
        residuals = self.observer.residuals(self.space, point[None], self.data.episodes)
        values, scales = _costs(residuals, self.data)
        return _State(point, float(values[0]) + self.space.surprise(point, self.centre), scales[0], residuals)

    def slopes(self, state: _State) -> np.ndarray:
        """Change of the residuals [D, E, T, channels] with each coordinate."""
        return self.observer.slopes(self.space, state.point, state.residuals[0], self.data.episodes, self.stride)

    def equations(self, state: _State, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Curvature [D, D] and slope [D] (downhill) of the cost; a coordinate whose curvature is 0 stays."""
        factor = influence(state.residuals[0], state.scale) * self.data.temper
        label = np.where(self.data.weight > 0, 0, -1)
        (curvature,), (slope,) = normal_equations(state.residuals[0], slopes, factor, label, 1)
        stiffness = self.space.stiffness(state.point, self.centre)
        curvature[np.diag_indices(self.space.size)] += stiffness
        slope += (self.centre - state.point) * stiffness
        return _held_at_bounds(state.point, curvature, slope, self.space)

    def step(self, state: _State, step: np.ndarray) -> _State:
        return self.at(np.clip(state.point + step, self.space.low, self.space.high))


def _held_at_bounds(
    point: np.ndarray, curvature: np.ndarray, slope: np.ndarray, space: Coordinates
) -> tuple[np.ndarray, np.ndarray]:
    """The equations without the coordinates that are pushed against a bound: they stay there."""
    stuck = ((point <= space.low) & (slope < 0)) | ((point >= space.high) & (slope > 0))
    free = ~stuck
    return curvature * np.outer(free, free), slope * free


def trials(
    point: np.ndarray, curvature: np.ndarray, slope: np.ndarray, dampings: np.ndarray, space: Coordinates
) -> np.ndarray:
    """Where each damping leads; coordinates that are pushed against a bound stay there."""
    held = _held_at_bounds(point, curvature, slope, space)
    return np.array([np.clip(point + damped_step(*held, each), space.low, space.high) for each in dampings])
