"""The numbers of the table against numbers worked out otherwise."""

import math

import numpy as np
import pytest
from scipy.stats import bootstrap

from vision_s2r import statistics
from vision_s2r.statistics import Bootstrap, interval, lower_bound, mcnemar, over_clusters, shapley, wilson


@pytest.mark.parametrize(("held", "of"), [(held, of) for of in (1, 40, 100) for held in (0, of)])
def test_an_interval_of_a_share_holds_it_at_both_ends(held, of):
    """Rounding left 0 of 100 below its own interval, and a robot on which nothing held ended close-gap in an error."""
    found = wilson(held, of)
    assert found.low <= found.value <= found.high


def test_wilson_by_hand():
    # (p + z²/2n ± z sqrt(p(1-p)/n + z²/4n²)) / (1 + z²/n) with p = 0.81, n = 263, z = 1.959964:
    # Newcombe 1998, table I, 81 of 263
    estimate = wilson(81, 263)
    assert (estimate.low, estimate.high) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(20, 20).high == pytest.approx(1)
    assert wilson(20, 20).low == pytest.approx(1 / (1 + 1.959964**2 / 20), abs=1e-6)


def test_mcnemar_by_hand():
    first = np.array([True] * 9 + [False] * 2 + [True] * 30)
    second = np.array([False] * 9 + [True] * 2 + [True] * 30)
    # 11 scenes decide: 2 · (C(11,0) + C(11,1) + C(11,2)) / 2¹¹
    assert mcnemar(first, second) == pytest.approx(2 * (1 + 11 + 55) / 2**11)
    assert mcnemar(first, first) == 1


def test_a_difference_on_the_same_scenes_is_surer_than_on_others():
    rng = np.random.default_rng(0)
    first = rng.random((1, 400)) < 0.6
    second = first & (rng.random((1, 400)) < 0.93)  # fails wherever the first does, and a little more
    paired = Bootstrap(400).difference(first, second)
    unpaired = Bootstrap(400).difference(first, rng.permuted(second, axis=1))
    assert paired.value == pytest.approx(first.mean() - second.mean())
    assert 0 < paired.low < paired.value < paired.high
    assert paired.high - paired.low < 0.5 * (unpaired.high - unpaired.low)


@pytest.mark.parametrize("seeds", [1, 3])
def test_the_interval_of_a_difference_covers_the_truth(seeds, monkeypatch):
    """150 experiments on new scenes, some hard and some easy for both rows: 95 % of intervals hold the truth."""
    monkeypatch.setattr(statistics, "RESAMPLES", 1000)
    rng = np.random.default_rng(1)
    covered, trials, scenes = 0, 150, 120
    bootstrap = Bootstrap(scenes)
    for _ in range(trials):
        hard = rng.random(scenes) < 0.3
        chance = np.where(hard, 0.2, 0.9)
        first = rng.random((seeds, scenes)) < chance
        second = rng.random((seeds, scenes)) < chance - 0.1
        estimate = bootstrap.difference(first, second)
        covered += estimate.low <= 0.1 <= estimate.high
    assert 0.89 < covered / trials <= 1


def test_several_seeds_on_the_same_scenes_are_not_as_many_independent_trials():
    rng = np.random.default_rng(2)
    one = rng.random((1, 300)) < 0.7
    thrice = np.repeat(one, 3, axis=0)  # three trainings that agree on every scene know no more than one
    estimate = Bootstrap(300).success(thrice)
    alone = Bootstrap(300).success(one)
    assert (estimate.low, estimate.high) == pytest.approx((alone.low, alone.high), abs=0.01)
    naive = wilson(3 * int(one.sum()), 900)
    assert estimate.high - estimate.low > 1.5 * (naive.high - naive.low)


def test_trainings_that_disagree_widen_the_interval():
    rng = np.random.default_rng(3)
    alike = rng.random((3, 300)) < 0.6
    unlike = rng.random((3, 300)) < np.array([[0.9], [0.6], [0.3]])
    widths = [estimate.high - estimate.low for estimate in map(Bootstrap(300).success, (alike, unlike))]
    assert widths[1] > 3 * widths[0]


def test_all_alike_is_not_certain():
    estimate = Bootstrap(50).success(np.ones((3, 50), bool))
    assert estimate.value == 1
    assert 0.9 < estimate.low < 0.95


def test_ratios_over_little_or_nothing():
    none, some = np.zeros((1, 40), bool), np.arange(40)[None] < 20
    bootstrap = Bootstrap(40)
    assert bootstrap.ratio(some, none).value == math.inf
    nothing = bootstrap.ratio(none, none)
    assert math.isnan(nothing.value) and (nothing.low, nothing.high) == (0, math.inf)
    half = bootstrap.ratio(some, np.ones((1, 40), bool))
    assert half.value == 0.5 and 0.3 < half.low < 0.5 < half.high < 0.7


def test_the_same_seed_gives_the_same_interval():
    outcomes = np.random.default_rng(3).random((3, 60)) < 0.5
    assert Bootstrap(60, seed=4).success(outcomes) == Bootstrap(60, seed=4).success(outcomes)
    assert (Bootstrap(60, seed=4).means(outcomes) != Bootstrap(60, seed=5).means(outcomes)).any()


def test_every_bootstrap_of_a_mean_is_scipys():
    values = np.random.default_rng(6).gamma(2.0, size=80)
    known = bootstrap((values,), np.mean, n_resamples=10_000, method="percentile", rng=np.random.default_rng(0))
    expected, noise = known.confidence_interval, 0.1 * values.std() / math.sqrt(len(values))
    segments = interval(lambda counts: counts @ values / len(values), len(values), seed=1)
    clusters = over_clusters(lambda drawn: values[list(drawn)].mean(), len(values), seed=1)
    scenes = statistics._percentiles(0, Bootstrap(len(values)).means(values[None]))
    for low, high in (segments, clusters, (scenes.low, scenes.high)):
        assert (low, high) == pytest.approx(tuple(expected), abs=2 * noise)
    bound = np.quantile(known.bootstrap_distribution, 0.025) * len(values)
    assert lower_bound(values, 0.975, seed=1) == pytest.approx(bound, abs=2 * noise * len(values))


def test_shapley_divides_what_is_won_together_evenly_and_all_of_it():
    def worth(names):
        return np.array([2.0 * ("a" in names) + 3.0 * ({"b", "c"} <= names), 1.0 * ("c" in names)])

    parts = shapley(["a", "b", "c"], worth)
    assert parts["a"] == pytest.approx([2, 0]) and parts["b"] == pytest.approx([1.5, 0])
    assert parts["c"] == pytest.approx([1.5, 1]) and sum(parts.values()) == pytest.approx(worth({"a", "b", "c"}))
