"""How much of reality a range covers: by hand, exactly, and by counting."""

import math

import numpy as np
import pytest
from effects_to_draw import EFFECTS

from vision_s2r.errors import UserError
from vision_s2r.randomize import AdrConfig, AutomaticDomainRandomization, Box, Dimension, Posterior, Range
from vision_s2r.randomize.coverage import covered, covered_of_box, covers, sampled_coverage

HAND_PICKED = Box.of(
    {"damping": {"value": [0.10, 0.16]}, "play": {"probability": 0.5, "width": [1e-3, 1e-2]}},
    EFFECTS,
    {"damping": {"value": 0.1}},
)


def test_the_issues_example_to_the_digit() -> None:
    assert f"{100 * covered(Range(0.10, 0.16), Range(0.09, 0.18)):.1f} %" == "66.7 %"


@pytest.mark.parametrize(
    ("cover", "target", "share"),
    [
        (Range(0.0, 1.0), Range(0.2, 0.3), 1.0),
        (Range(0.0, 0.1), Range(0.2, 0.3), 0.0),
        (Range(0.1, 0.2), Range(0.2, 0.2), 1.0),
        (Range(0.1, 0.2), Range(0.3, 0.3), 0.0),
        (Range(0.2, 0.2), Range(0.1, 0.3), 0.0),
        (Range(1.0, math.inf), Range(0.5, 1.5), 0.5),
    ],
)
def test_ranges_of_every_position(cover: Range, target: Range, share: float) -> None:
    assert covered(cover, target) == pytest.approx(share)


def test_a_decade_is_a_decade_on_a_log_scale() -> None:
    assert covered(Range(1e-3, 1e-2), Range(1e-4, 1e-1), "log") == pytest.approx(1 / 3)


def test_of_boxes_it_is_the_product_and_counting_agrees() -> None:
    target = Box.of({"damping": {"value": [0.09, 0.18]}, "play": {"probability": 0.75, "width": [1e-4, 1e-2]}}, EFFECTS)
    # Play: a quarter without it, which is covered; of the others, one decade of two.
    assert covered_of_box(HAND_PICKED, target) == pytest.approx(2 / 3 * (0.25 + 0.75 * 0.5))
    always = Box.of({"play": {"width": [1e-3, 1e-2]}}, EFFECTS)
    alone = Box.of({"play": target_play(0.75)}, EFFECTS)
    assert covered_of_box(always, alone) == pytest.approx(0.75 * 0.5)  # never without
    assert covered_of_box(Box.of({}, EFFECTS), alone) == pytest.approx(0.25)  # never with
    sampled = sampled_coverage(HAND_PICKED, target, 4000, np.random.default_rng(0))
    assert sampled.count == 4000 and sampled.share == sampled.covered / 4000
    assert sampled.low < covered_of_box(HAND_PICKED, target) < sampled.high
    share, z2 = sampled.share, 1.959964**2  # Wilson's interval, by its formula
    half = math.sqrt(z2 * share * (1 - share) / 4000 + z2**2 / 4 / 4000**2) / (1 + z2 / 4000)
    assert sampled.high - sampled.low == pytest.approx(2 * half)
    # The nominal point lies in the range, and is where the effect is off: covered, and once.
    nominal = {"damping": {"value": 0.1}}
    both = Box.of({"damping": {"probability": 0.5, "value": [0.1, 0.2]}}, EFFECTS, nominal)
    assert covered_of_box(both, Box.of({"damping": {"value": 0.1}}, EFFECTS)) == 1


def target_play(probability: float) -> dict[str, object]:
    return {"probability": probability, "width": [1e-4, 1e-2]}


def test_of_a_posterior_it_is_counted() -> None:
    posterior = Posterior(EFFECTS, {"damping": {"value": 0.13}}, np.array([[0.03**2]]))
    found = sampled_coverage(HAND_PICKED, posterior, 4000, np.random.default_rng(0))
    assert found.low < 0.6827 < found.high  # one deviation on each side


def test_ranges_that_widen_cover_more() -> None:
    dimensions = [Dimension("damping", "value", 0.1, 0.0, 0.5), Dimension("play", "width", 0.0, 1e-4, 1e-1)]
    widening = AutomaticDomainRandomization(dimensions, EFFECTS, AdrConfig(buffer=1))
    target = Box.of({"damping": {"value": [0.09, 0.18]}, "play": target_play(0.5)}, EFFECTS)
    shares = [covered_of_box(widening, target)]
    for _ in range(20):
        widening.record(np.arange(4), np.full(4, 30.0))
        shares.append(covered_of_box(widening, target))
    assert shares[0] == 0 and shares == sorted(shares)
    # After 20 steps of 2 %: damping from 0 to 0.3, all of it; play to 40 % of three decades, 1.2 of two.
    assert shares[-1] == pytest.approx(0.5 + 0.5 * 0.6)
    # The nominal point, which is beyond the limits, is covered all the time.
    samples = {"damping": {"value": np.array([0.1, 0.1, 0.4])}, "play": {"width": np.array([0.0, 0.05, 0.0])}}
    assert covers(widening, samples).tolist() == [True, False, False]
    sampled = sampled_coverage(widening, target, 2000, np.random.default_rng(0))
    assert sampled.low < shares[-1] < sampled.high


def test_what_is_not_drawn_is_at_its_neutral_value_or_an_error() -> None:
    box = Box.of({"play": {"width": [1e-3, 1e-2]}}, EFFECTS)
    widening = AutomaticDomainRandomization([Dimension("play", "width", 0.0, 1e-4, 1e-1)], EFFECTS)
    for cover in (box, widening):
        assert covers(cover, {"tone": {"gamma": np.array([1.0, 1.1])}}).tolist() == [True, False]
        with pytest.raises(UserError, match=r"damping: no .*nominal value is known"):
            covers(cover, {"damping": {"value": np.array([0.1])}})
    nominal = Box.of({}, EFFECTS, {"damping": {"value": 0.1}})
    assert covers(nominal, {"damping": {"value": np.array([0.1, 0.2])}}).tolist() == [True, False]
