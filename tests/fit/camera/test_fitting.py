"""The fit of a camera's effects: how many predictions it takes."""

import numpy as np
import pytest

from tests.fit.camera.test_camera_case import opened, recorded
from vision_s2r.fit.camera import fitting
from vision_s2r.fit.camera.fitting import gauss_newton
from vision_s2r.fit.camera.intervals import relative_spread


def test_short_steps_carry_their_slopes_on_to_the_same_optimum(monkeypatch: pytest.MonkeyPatch) -> None:
    case = opened(recorded(exposure={"stops": 0.4}, vignetting={"strength": 0.3}))
    start = {"exposure": {"stops": 0.37}, "vignetting": {"strength": 0.27}}
    asked: list[int] = []
    columns = fitting.columns
    monkeypatch.setattr(fitting, "columns", lambda *given: asked.append(1) or columns(*given))
    ends = []
    for short in (0.0, fitting._SHORT):
        monkeypatch.setattr(fitting, "_SHORT", short)
        asked.clear()
        found, _ = gauss_newton(case._fitter.target, start, list(start), [0, 1], 8)
        ends.append((found, len(asked)))
    (one, often), (other, seldom) = ends
    assert seldom < often
    assert one["exposure"]["stops"] == pytest.approx(other["exposure"]["stops"], abs=1e-3)
    assert one["vignetting"]["strength"] == pytest.approx(other["vignetting"]["strength"], abs=1e-3)


def test_a_fit_leaves_an_upper_bound() -> None:
    case = opened(recorded(vignetting={"strength": 0.8}))
    found, _ = gauss_newton(case._fitter.target, {"vignetting": {"strength": 1.0}}, ["vignetting"], [0, 1], 8)
    assert found["vignetting"]["strength"] == pytest.approx(0.8, abs=0.01)


def test_lenses_that_bend_alike_do_not_differ() -> None:
    curvature = np.array([[1.0, 0.999], [0.999, 1.0]])  # of k1 and k2, which hardly differ in what they do
    groups = np.array([[0.4, -0.4], [-0.4, 0.4], [0.3, -0.3], [-0.3, 0.3]])
    assert relative_spread(groups, np.array([1.0, 0.0]), curvature) < 0.1
    assert relative_spread(groups + np.array([[0.4], [-0.4], [0.0], [0.0]]), np.array([1.0, 0.0]), curvature) > 0.3
