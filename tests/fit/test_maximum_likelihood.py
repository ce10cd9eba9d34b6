"""Descents of a likelihood whose residuals have outliers: the weights change more than the derivatives do."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.coordinates import Coordinates
from vision_s2r.fit.maximum_likelihood import Data, minimize

SIZE, SAMPLES = 12, 400


class Lines(Coordinates):
    """Coefficients without a prior."""

    def __init__(self) -> None:
        self.effects, self.owner, self.size = [], [""] * SIZE, SIZE
        self.low, self.high, self.step = np.full(SIZE, -100.0), np.full(SIZE, 100.0), np.full(SIZE, 1e-4)
        self.prior, self.centre, self.repeats = np.full(SIZE, np.inf), np.full(SIZE, np.nan), np.ones(SIZE)

    def start(self, hypothesis: Hypothesis) -> np.ndarray:
        return np.zeros(SIZE)

    def hypothesis(self, point: np.ndarray, extra: Mapping[str, Any]) -> Hypothesis:
        return Hypothesis(extra={"point": point, **extra})


class Heavy:
    """A slightly bent function of the coefficients, under noise that is large now and then; counts its runs."""

    channels = 1

    def __init__(self) -> None:
        rng = np.random.default_rng(3)
        self.columns, self.runs = rng.normal(size=(SIZE, SAMPLES)), 0
        self.measured = self._shown(rng.normal(size=(1, SIZE)))[0] + 0.1 * rng.standard_t(1.5, SAMPLES)

    def _shown(self, points: np.ndarray) -> np.ndarray:
        straight = points @ self.columns
        return straight + 0.02 * np.sin(straight)

    def residuals(self, space: Lines, points: np.ndarray, episodes: Sequence[int]) -> np.ndarray:
        self.runs += len(points)
        return (self.measured - self._shown(points))[:, None, :, None]


def descended(more: int) -> tuple[float, int]:
    observer = Heavy()
    data = Data((0,), np.ones((1, SAMPLES)), np.full(1, 1e-6), np.ones(1))
    found = minimize(observer, Lines(), data, np.zeros(SIZE), 12, more=more)
    return found.cost, observer.runs


def test_steps_with_known_derivatives_lead_to_the_same_optimum_sooner() -> None:
    (cost, runs), (plain, needed) = descended(3), descended(0)
    assert abs(cost - plain) < 0.05 and runs < 0.8 * needed
