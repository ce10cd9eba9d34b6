"""Ranges that widen with the policy's performance, and go on after a restart as if nothing had been."""

import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from effects_to_draw import EFFECTS

from vision_s2r.errors import UserError
from vision_s2r.randomize import AdrConfig, AutomaticDomainRandomization, Dimension

DAMPING = Dimension("damping", "value", nominal=0.1, low=0.0, high=0.5)
PLAY = Dimension("play", "width", nominal=0.0, low=1e-4, high=1e-1)
STIFFNESS = Dimension("spring", "stiffness", nominal=math.inf, low=1.0, high=1e4, step=0.05)
SMALL = AdrConfig(buffer=10)
LOW, HIGH = 0, 1  # boundaries of the first dimension


def automatic(*dimensions: Dimension, config: AdrConfig = SMALL, seed: int = 0) -> AutomaticDomainRandomization:
    return AutomaticDomainRandomization(dimensions or (DAMPING,), EFFECTS, config, seed)


def measure(randomization: AutomaticDomainRandomization, boundary: int, performance: float, count: int = 10) -> None:
    randomization.record(np.full(count, boundary), np.full(count, performance))


def train(randomization: AutomaticDomainRandomization, policy: Callable[..., np.ndarray], rounds: int) -> None:
    """`policy` says its performance on values; draws of 64 at a time."""
    for _ in range(rounds):
        drawn = randomization.draw(64)
        randomization.record(drawn.boundary, policy(drawn.values))


def test_the_papers_values_are_the_defaults() -> None:
    assert AdrConfig() == AdrConfig(240, 20.0, 10.0, 0.02, 0.5)


def test_a_boundary_widens_where_the_policy_performs_well_and_narrows_where_it_does_not() -> None:
    randomization = automatic()
    measure(randomization, HIGH, 19.0, 5)
    measure(randomization, HIGH, 21.0, 4)
    assert randomization.ranges()["damping"]["value"].high == 0.1  # nine of ten results are no decision
    measure(randomization, HIGH, 21.0, 1)
    assert tuple(randomization.ranges()["damping"]["value"]) == pytest.approx((0.1, 0.11))  # the mean is 20
    measure(randomization, HIGH, 15.0)
    measure(randomization, HIGH, 19.0, 9)  # a decision clears the buffer, so these are few again
    assert randomization.ranges()["damping"]["value"].high == pytest.approx(0.11)
    measure(randomization, LOW, 25.0)
    measure(randomization, HIGH, 25.0)
    assert tuple(randomization.ranges()["damping"]["value"]) == pytest.approx((0.09, 0.12))
    measure(randomization, HIGH, 10.0)
    assert tuple(randomization.ranges()["damping"]["value"]) == pytest.approx((0.09, 0.11))


def test_a_dimension_may_have_a_step_of_its_own() -> None:
    randomization = automatic(DAMPING, STIFFNESS)
    for boundary in (HIGH, 2):
        measure(randomization, boundary, 30.0)
    assert randomization.ranges()["damping"]["value"].high == pytest.approx(0.1 + 0.02 * 0.5)
    assert randomization.ranges()["spring"]["stiffness"].low == pytest.approx(10 ** (4 * 0.95))


def test_a_boundary_never_crosses_the_nominal_point_or_its_limit() -> None:
    randomization = automatic()
    measure(randomization, LOW, 0.0)
    assert tuple(randomization.ranges()["damping"]["value"]) == (0.1, 0.1)
    for performance in (30.0, 30.0, 30.0, 0.0, 0.0, 0.0):
        measure(randomization, HIGH, performance)
    assert randomization.entropy == -math.inf  # three steps out and back are none
    for _ in range(60):
        measure(randomization, LOW, 30.0)
        measure(randomization, HIGH, 30.0)
    assert tuple(randomization.ranges()["damping"]["value"]) == (0.0, 0.5)
    assert randomization.entropy == 0


def test_results_beyond_the_buffer_move_a_boundary_once() -> None:
    """They were all measured at one boundary: nothing is known of the next."""
    randomization = automatic()
    measure(randomization, HIGH, 25.0, 35)
    assert randomization.ranges()["damping"]["value"].high == pytest.approx(0.11)
    measure(randomization, HIGH, 25.0, 9)  # none of the 35 is left
    assert randomization.ranges()["damping"]["value"].high == pytest.approx(0.11)


def test_draws_are_uniform_but_for_one_dimension_at_a_boundary() -> None:
    randomization = automatic(DAMPING, PLAY)
    for boundary in (0, 1, 3):
        for _ in range(5):
            measure(randomization, boundary, 30.0)
    drawn = randomization.draw(8000)
    damping, width = drawn.values["damping"]["value"], drawn.values["play"]["width"]
    low, high = randomization.ranges()["damping"]["value"]
    assert (low, high) == pytest.approx((0.05, 0.15))
    # Half from within, the others equally at the boundaries that have room: play's lower one is its nominal point.
    assert (drawn.boundary == -1).mean() == pytest.approx(0.5, abs=0.03)
    assert [(drawn.boundary == k).mean() for k in range(4)] == pytest.approx([1 / 6, 1 / 6, 0, 1 / 6], abs=0.02)
    assert (damping[drawn.boundary == 0] == low).all() and (damping[drawn.boundary == 1] == high).all()
    within = damping[~np.isin(drawn.boundary, [0, 1])]
    assert np.quantile(within, [0, 0.25, 0.5, 0.75, 1]) == pytest.approx([0.05, 0.075, 0.1, 0.125, 0.15], abs=0.003)
    assert (width[drawn.boundary == 3] == width.max()).all()
    assert randomization.ranges()["play"]["width"].high == width.max() == pytest.approx(1e-4 * 10 ** (3 * 0.1))
    assert np.median(width[drawn.boundary < 2]) == pytest.approx(1e-4 * 10 ** (3 * 0.05), rel=0.03)


def test_it_begins_without_the_effects_and_ends_where_the_policy_does() -> None:
    """Three dimensions at once, two of them with a neutral value that is no place on their scale."""
    randomization = automatic(DAMPING, PLAY, STIFFNESS)
    first = randomization.draw(20).values
    assert (first["damping"]["value"] == 0.1).all() and (first["play"]["width"] == 0).all()
    assert np.isinf(first["spring"]["stiffness"]).all()
    assert randomization.entropy == -math.inf

    def policy(values: dict[str, dict[str, np.ndarray]]) -> np.ndarray:
        manageable = (values["damping"]["value"] < 0.3) & (values["play"]["width"] < 1e-2)
        return 30.0 * (manageable & (values["spring"]["stiffness"] > 100))

    train(randomization, policy, 600)
    found = randomization.ranges()
    assert found["damping"]["value"].low == 0 and found["damping"]["value"].high == pytest.approx(0.3, abs=0.02)
    assert found["play"]["width"].low == 0 and found["play"]["width"].high == pytest.approx(1e-2, rel=0.4)
    assert found["spring"]["stiffness"].high == math.inf
    assert found["spring"]["stiffness"].low == pytest.approx(100, rel=0.6)
    assert randomization.entropy == pytest.approx(np.log([0.6, 2 / 3, 0.5]).mean(), abs=0.1)


def test_a_restart_has_the_same_future() -> None:
    def policy(values: dict[str, dict[str, np.ndarray]]) -> np.ndarray:
        return np.where(values["damping"]["value"] < 0.3, 25.0, 5.0)

    whole = automatic(DAMPING, STIFFNESS, seed=1)
    train(whole, policy, 25)
    resumed = automatic(DAMPING, STIFFNESS, seed=2)
    resumed.restore(json.loads(json.dumps(whole.state(), allow_nan=False)))
    for randomization in (whole, resumed):
        train(randomization, policy, 25)
    assert resumed.state() == whole.state() and whole.entropy > -2
    assert str(resumed.draw(50)) == str(whole.draw(50))


def test_a_state_of_other_dimensions_is_refused() -> None:
    with pytest.raises(UserError, match=r"state of other dimensions: .*damping\.value"):
        automatic(PLAY).restore(automatic(DAMPING).state())
    with pytest.raises(UserError, match="no state of an automatic randomization"):
        automatic().restore({"dimensions": [["damping.value", 0.0, 0.5, 0.2]]})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: automatic(Dimension("dampin", "value", 0.1, 0.0, 0.5)), "did you mean 'damping'"),
        (lambda: automatic(Dimension("damping", "value", 0.1, 0.5, 0.0)), r"is \[0.5, 0\], expected low before high"),
        (lambda: automatic(Dimension("damping", "value", 0.1, 0.0, 50.0)), "expected a range within 0 to 10"),
        (lambda: automatic(Dimension("damping", "value", 0.6, 0.0, 0.5)), "nominal is 0.6, expected 0 to 0.5"),
        (lambda: automatic(Dimension("tone", "gamma", 1.0, 1.2, 2.0)), "nominal is 1, expected 1.2 to 2"),
        (lambda: automatic(Dimension("damping", "value", 0.1, 0.0, 0.5, step=2.0)), "damping.value: step is 2"),
        (lambda: automatic(DAMPING, DAMPING), "each once"),
        (lambda: automatic(config=AdrConfig(threshold_low=30.0)), "expected low below high"),
        (lambda: automatic(config=AdrConfig(boundary_probability=0.0)), "boundary_probability is 0"),
        (lambda: automatic().record(np.array([2]), np.array([1.0])), "boundary 2: expected -1 to 1"),
        (lambda: automatic().record(np.array([1]), np.array([math.nan])), "performance is not finite"),
        (lambda: automatic().record(np.array([1]), np.array([1.0, 2.0])), "performance of shape"),
    ],
)
def test_what_cannot_be_is_one_clear_line(make: Callable[[], object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        make()
