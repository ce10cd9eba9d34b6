"""Damped Gauss-Newton: from a starting state downhill to the nearest optimum (Levenberg 1944; Marquardt 1963).

A problem linearizes itself at a state and says what states steps lead to; everything else is here.
"""

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from vision_s2r.fit.least_squares import solved


class State(Protocol):
    """Where a descent is; whatever else the problem wants to remember of it."""

    @property
    def cost(self) -> float:
        """What is minimized."""
        ...


S = TypeVar("S", bound=State)


class Problem(Protocol[S]):
    """What is minimized, in D coordinates."""

    def equations(self, state: S) -> tuple[np.ndarray, np.ndarray]:
        """Curvature [D, D] and slope [D] (downhill) of the cost; a coordinate whose curvature is 0 stays."""
        ...

    def step(self, state: S, step: np.ndarray) -> S:
        """The state that a step [D] leads to."""
        ...


@dataclass(frozen=True, kw_only=True)
class Damping:
    """How a descent is damped, and when it ends."""

    first: float
    raised: float = 1.0  # by this, where a step does not go down …
    least: float = 0.0  # … and to no less than this
    times: int = 1  # how often that is done before the descent ends
    lowered: float = 1.0  # by this, where it does
    bounds: tuple[float, float] = (0.0, np.inf)
    gain: float = 0.0  # less than this ends the descent
    relative_gain: float = 0.0  # the same, times the cost
    move: float = 0.0  # a step that is shorter than this in every coordinate ends it too


def damped_step(curvature: np.ndarray, slope: np.ndarray, damping: float) -> np.ndarray:
    """The step [D] to the optimum of a quadratic, damped in proportion to its own curvature along each axis."""
    scale = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    free = np.flatnonzero(scale > 1e-250)
    step = np.zeros(len(slope))
    scaled = curvature[np.ix_(free, free)] / scale[free] / scale[free, None]
    damped = scaled + damping * np.eye(len(free))
    step[free] = solved(damped, slope[free] / scale[free], 1e-12) / scale[free]
    return step


def descend(problem: Problem[S], start: S, iterations: int, rule: Damping, limits: np.ndarray | None = None) -> S:
    """The state after `iterations`, or where the rule ends the descent; `limits` [D] is as far as one step may go."""
    state, damping = start, rule.first
    for _ in range(iterations):
        curvature, slope = problem.equations(state)
        for _ in range(rule.times):
            step = damped_step(curvature, slope, damping)
            if limits is not None:
                step = step.clip(-limits, limits)
            trial = problem.step(state, step)
            if trial.cost < state.cost:
                break
            damping = max(damping * rule.raised, rule.least)
        else:
            return state
        gained, state = state.cost - trial.cost, trial
        damping = float(np.clip(damping / rule.lowered, *rule.bounds))
        if gained < max(rule.gain, rule.relative_gain * state.cost) or np.abs(step).max() < rule.move:
            break
    return state
