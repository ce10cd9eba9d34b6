"""Damped Gauss-Newton beside SciPy's least squares."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import least_squares

from vision_s2r.fit.gauss_newton import Damping, damped_step, descend
from vision_s2r.fit.least_squares import solved

T = np.linspace(0, 3, 60)
RULE = Damping(first=1e-4, raised=20, least=1e-2, times=4, lowered=10, bounds=(1e-5, np.inf))
CASES: dict[str, tuple[Callable[[np.ndarray], np.ndarray], list[float]]] = {
    "Rosenbrock": (lambda x: np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]), [-1.2, 1.0]),
    "decay": (
        lambda x: x[0] * np.exp(-x[1] * T) + x[2] - (2 * np.exp(-1.3 * T) + 0.5 + 0.1 * np.cos(9 * T)),
        [1, 0.3, 0],
    ),
    "scales": (lambda x: 1e4 * x[0] * T + np.sin(x[1] * 1e-3 * T) - (3 * T + np.sin(1.7 * T)), [0.0, 1000.0]),
}


@dataclass(frozen=True)
class Here:
    point: np.ndarray
    cost: float


@dataclass(frozen=True)
class Squares:
    residual: Callable[[np.ndarray], np.ndarray]

    def at(self, point: np.ndarray) -> Here:
        return Here(point, 0.5 * float((self.residual(point) ** 2).sum()))

    def equations(self, state: Here) -> tuple[np.ndarray, np.ndarray]:
        steps = 1e-7 * np.maximum(np.abs(state.point), 1e-3)
        now = self.residual(state.point)
        slopes = [(self.residual(state.point + step) - now) / step.sum() for step in np.diag(steps)]
        return np.array(slopes) @ np.array(slopes).T, -np.array(slopes) @ now

    def step(self, state: Here, step: np.ndarray) -> Here:
        return self.at(state.point + step)


@pytest.mark.parametrize("case", CASES)
def test_it_ends_where_scipy_does(case: str) -> None:
    residual, start = CASES[case]
    problem = Squares(residual)
    found = descend(problem, problem.at(np.array(start, float)), 200, RULE)
    known = least_squares(residual, start, x_scale="jac")
    assert found.cost == pytest.approx(known.cost, rel=1e-6, abs=1e-12)
    assert found.point == pytest.approx(known.x, rel=1e-3, abs=1e-6)


def test_what_shows_nothing_stays_and_no_step_is_longer_than_its_limit() -> None:
    curvature, slope = np.diag([4.0, 0.0]), np.array([2.0, 5.0])
    assert damped_step(curvature, slope, 1.0) == pytest.approx([0.25, 0.0])
    problem = Squares(lambda x: np.array([x[0] - 3]))
    here = descend(problem, problem.at(np.zeros(1)), 2, Damping(first=0.0), limits=np.array([0.5]))
    assert here.point == pytest.approx([1.0])


def test_least_squares_are_the_shortest_that_are_nearest():
    rng = np.random.default_rng(0)
    matrix, target = rng.standard_normal((9, 4)), rng.standard_normal((9, 2))
    np.testing.assert_allclose(solved(matrix, target, 1e-9), np.linalg.lstsq(matrix, target)[0], atol=1e-12)
    twice = np.c_[matrix, matrix[:, 0]]  # what two columns do alike they share
    found = solved(twice, target[:, 0], 1e-9)
    assert found[0] == pytest.approx(found[4]) and 2 * found[0] == pytest.approx(solved(matrix, target[:, 0], 1e-9)[0])
    assert solved(np.zeros((0, 3)), np.zeros(0), 1e-9).tolist() == [0.0, 0.0, 0.0]
