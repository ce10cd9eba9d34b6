"""Maximum likelihood by damped Gauss-Newton: derivatives by differences, all of them one batch of machines.

Each channel (position, velocity) has a scale of its own, as large as its residual and no smaller than its floor; what
is minimized is the negative log-likelihood with the scales at their best. (Large residuals by iteratively
reweighted least squares.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from vision_s2r.fit.coordinates import Coordinates
from vision_s2r.fit.gauss_newton import Damping, damped_step, descend
from vision_s2r.fit.likelihood import influence, normal_equations, profile

# Machines are simulated in batches, so that several steps are tried at once; less than 0.02 nats is no gain.
RULE = Damping(first=1e-3, tried=(0.03, 1.0, 100.0, 1e4), bounds=(1e-9, 1e4), gain=0.02)
SETTLED = 0.1  # nats: where a step by slopes that are found anew gains less, the next would gain less than RULE.gain
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
C = TypeVar("C", bound=Coordinates, contravariant=True)


class Residuals(Protocol[C]):
    """What points of a space leave unexplained."""

    @property
    def channels(self) -> int:
        """Of the residuals."""
        ...

    def residuals(self, space: C, points: np.ndarray, episodes: Sequence[int], /) -> np.ndarray:
        """Measured less predicted [C, E, T, channels] of points [C, D]."""
        ...


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
        found = _descend(observer, space, data, best.point, start, stride, iterations)
        if found.cost < best.cost:
            best = found
    return best


def minimize_carrying(observer: Residuals[S], space: S, data: Data, start: np.ndarray, iterations: int) -> Fitted:
    """As `minimize`, where a batch of machines takes as long as its parts.

    Steps are tried one by one. Slopes are carried from step to step (Broyden, Mathematics of Computation 19, 1965), and
    found anew where a step brings less than half of what they promise.
    """
    descent = _Descent(observer, space, data, space.believed(start), 1.0)
    state, damping, slopes = descent.at(start[None])[0], RULE.first, None
    for _ in range(iterations):
        fresh = slopes is None
        slopes = descent.slopes(state) if slopes is None else slopes
        curvature, slope = descent.linear(state, slopes)
        best, enough = state, False
        for factor in RULE.tried if fresh else RULE.tried[:1]:
            trial = descent.steps(state, damped_step(curvature, slope, damping * factor)[None])[0]
            moved = trial.point - state.point
            promised = float(moved @ slope - 0.5 * moved @ curvature @ moved)
            enough = state.cost - trial.cost >= ENOUGH * promised
            if trial.cost < best.cost:
                best, chosen = trial, damping * factor
            if enough:
                break
        gained = state.cost - best.cost
        if gained > 0:
            moved, damping = best.point - state.point, float(np.clip(chosen, *RULE.bounds))
            slopes = _carried(slopes, best.residuals - state.residuals, moved, space.step)
            state = best
        if fresh and gained < SETTLED:
            break
        if not fresh and (not enough or gained < SETTLED):
            slopes = None  # at an optimum by slopes of elsewhere there need be none
    return Fitted(state.point, state.cost, state.scale)


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

    def at(self, points: np.ndarray) -> list[_State]:
        residuals = self.observer.residuals(self.space, points, self.data.episodes)
        values, scales = _costs(residuals, self.data)
        return [
            _State(point, float(values[k]) + self.space.surprise(point, self.centre), scales[k], residuals[k : k + 1])
            for k, point in enumerate(points)
        ]

    def equations(self, state: _State) -> tuple[np.ndarray, np.ndarray]:
        points, steps = self.space.differences(state.point, self.stride)
        around = self.observer.residuals(self.space, points[1:], self.data.episodes)
        return self._of(state, np.concatenate([state.residuals, around]), steps)

    def _of(self, state: _State, residuals: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        curvature, slope = _normal(residuals, steps, state.scale, self.data)
        stiffness = self.space.stiffness(state.point, self.centre)
        curvature[np.diag_indices(self.space.size)] += stiffness
        slope += (self.centre - state.point) * stiffness
        return _held_at_bounds(state.point, curvature, slope, self.space)

    def slopes(self, state: _State) -> np.ndarray:
        """Change of the residuals [D, E, T, channels] with each coordinate."""
        points, steps = self.space.differences(state.point, self.stride)
        around = self.observer.residuals(self.space, points[1:], self.data.episodes)
        return (around - state.residuals) / steps[:, None, None, None]

    def linear(self, state: _State, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The equations by these slopes."""
        around = np.concatenate([state.residuals, state.residuals + slopes])
        return self._of(state, around, np.ones(self.space.size))

    def steps(self, state: _State, steps: np.ndarray) -> list[_State]:
        return self.at(np.clip(state.point + steps, self.space.low, self.space.high))


def _descend(
    observer: Residuals[S], space: S, data: Data, point: np.ndarray, centre: np.ndarray, stride: float, iterations: int
) -> Fitted:
    descent = _Descent(observer, space, data, space.believed(centre), stride)
    found = descend(descent, descent.at(point[None])[0], iterations, RULE)
    return Fitted(found.point, found.cost, found.scale)


def _held_at_bounds(
    point: np.ndarray, curvature: np.ndarray, slope: np.ndarray, space: Coordinates
) -> tuple[np.ndarray, np.ndarray]:
    """The equations without the coordinates that are pushed against a bound: they stay there."""
    stuck = ((point <= space.low) & (slope < 0)) | ((point >= space.high) & (slope > 0))
    free = ~stuck
    return curvature * np.outer(free, free), slope * free


def _normal(residuals: np.ndarray, steps: np.ndarray, scale: np.ndarray, data: Data) -> tuple[np.ndarray, np.ndarray]:
    """Curvature [D, D] and slope [D] of the log-likelihood, from residuals at a point and one step along each axis."""
    factor = influence(residuals[0], scale) * data.temper
    label = np.where(data.weight > 0, 0, -1)
    curvature, slope = normal_equations(residuals, steps, factor, label, 1)
    return curvature[0], slope[0]


def trials(
    point: np.ndarray, curvature: np.ndarray, slope: np.ndarray, dampings: np.ndarray, space: Coordinates
) -> np.ndarray:
    """Where each damping leads; coordinates that are pushed against a bound stay there."""
    held = _held_at_bounds(point, curvature, slope, space)
    return np.array([np.clip(point + damped_step(*held, each), space.low, space.high) for each in dampings])
