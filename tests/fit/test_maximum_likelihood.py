"""The likeliest point of a made-up observer, beside SciPy's."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize as by_scipy

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.coordinates import Coordinates
from vision_s2r.fit.maximum_likelihood import Data, Residuals, costs, minimize

T = np.linspace(0, 3, 300)


class Free(Coordinates):
    """Coordinates without bounds or beliefs."""

    def __init__(self, size: int) -> None:
        self.effects, self.owner, self.size = [], [""] * size, size
        self.low, self.high, self.step = np.full(size, -1e3), np.full(size, 1e3), np.full(size, 1e-4)
        self.prior, self.centre, self.repeats = np.full(size, np.inf), np.full(size, np.nan), np.ones(size)

    def start(self, hypothesis: Hypothesis) -> np.ndarray:
        raise NotImplementedError

    def hypothesis(self, point: np.ndarray, extra: Mapping[str, Any]) -> Hypothesis:
        raise NotImplementedError


class Decay(Residuals[Free]):
    """A swing that dies away, seen with noise and a few instants that nothing explains."""

    channels = 1

    def __init__(self) -> None:
        rng = np.random.default_rng(0)
        self.seen = self._at(np.array([2.0, 0.7, 5.0, 0.3, 0.5])) + 0.02 * rng.standard_normal(len(T))
        self.seen[::50] += 1.0
        self.asked: list[int] = []  # points of each batch

    def _at(self, x: np.ndarray) -> np.ndarray:
        return x[0] * np.exp(-x[1] * T) * np.sin(x[2] * T + x[3]) + x[4]

    def residuals(self, space: Free, points: np.ndarray, episodes: Sequence[int]) -> np.ndarray:
        self.asked.append(len(points))
        return np.array([self.seen - self._at(x) for x in points])[:, None, :, None]


def test_it_ends_where_scipy_does_and_seldom_asks_for_slopes() -> None:
    decay, space = Decay(), Free(5)
    data = Data((0,), np.ones((1, len(T))), np.array([1e-6]), np.ones(1))
    start = np.array([1.5, 0.4, 4.7, 0.5, 0.3])
    found = minimize(decay, space, data, start, 20)
    slopes, steps = decay.asked.count(space.size), decay.asked.count(1)
    known = by_scipy(lambda x: costs(decay, space, data, x[None])[0][0], found.point, method="Nelder-Mead")
    assert found.cost == pytest.approx(known.fun, abs=0.05)
    assert found.point == pytest.approx([2.0, 0.7, 5.0, 0.3, 0.5], abs=0.02)
    assert slopes <= 4 < steps
