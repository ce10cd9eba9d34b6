"""What the core makes of recordings whose truth is known, whatever their kind."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.diagnose.stand_in import CURVES, DISCREPANCIES, Curves, T, recording
from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.config import SearchConfig
from vision_s2r.diagnose.guesses import _with_causes
from vision_s2r.diagnose.one_case import by_free_runs
from vision_s2r.diagnose.report import report
from vision_s2r.diagnose.search import COINCIDENCE, Found, Search
from vision_s2r.diagnose.settle import settle
from vision_s2r.diagnose.simulator import simulator_at_end, simulator_of
from vision_s2r.fit.case import Hypothesis, Names, Segments


def diagnosed(
    y: np.ndarray, beside: bool = False, known: bool = False, faint: float = 0.0, plain: bool = False, **case: Any
) -> dict[str, Any]:
    it = Curves(y, **case)
    assessor = Assessor(it, SearchConfig(beside=beside, known=known, faint=faint, plain=plain), jobs=2, seed=0)
    return report(it, assessor, settle(it, assessor, Search(it, assessor).run()))[0]


def names(found: dict[str, Any]) -> set[str]:
    return {effect["name"] for effect in found["effects"]}


def test_nulls_are_no_gap() -> None:
    for seed in range(20):
        found = diagnosed(recording(seed))
        assert found["verdict"] == "no_gap"
        assert not found["effects"]


@pytest.mark.parametrize("truth", [{"wave": 0.5}, {"slope": 0.3}, {"wave": 0.3, "offset": -0.4}, {"curve": 0.4}])
def test_the_exact_set_is_named_with_its_share_and_shrink(truth: dict[str, float]) -> None:
    found = diagnosed(recording(1, **truth))
    assert found["verdict"] == "explained"
    assert names(found) == set(truth)
    assert found["gap"]["shrink"] > 0.95
    assert sum(effect["share"] for effect in found["effects"]) == pytest.approx(1, abs=0.05)
    for effect in found["effects"]:
        assert effect["parameters"]["size"]["value"] == pytest.approx(truth[effect["name"]], abs=0.05)


def test_where_nothing_is_left_pairs_need_not_be_looked_for() -> None:
    it, largest = Curves(recording(1, wave=0.5)), {}
    for hidden in (True, False):
        assessor = Assessor(it, SearchConfig(promising=0.0, hidden=hidden), jobs=1, seed=0)
        assert Search(it, assessor).run().effects == {"wave"}
        largest[hidden] = max(len(found - it.refitted) for found in assessor.assessed)
    assert largest == {True: 3, False: 1}


def test_what_shows_once_an_effect_has_taken_its_rivals_place_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    it = Curves(recording(1, step=2.0, wave=0.5))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    search = Search(it, assessor)
    grow, ended = search._grow, [assessor.one(it.refitted | {"late_step"})]  # beside which nothing was worth its name
    monkeypatch.setattr(search, "_grow", lambda base, most: ended.pop() if ended else grow(base, most))
    assert search.run().effects == {"step", "wave"}


def test_a_name_that_parts_of_the_recording_contradict_is_not_given_though_it_explains_all() -> None:
    found = diagnosed(recording(1, wave=0.5, curve=0.4), contradictory=frozenset({"wave"}))
    assert found["verdict"] in ("partly_explained", "unexplained")
    assert "wave" not in names(found)


def test_refitting_does_not_pass_for_an_effect_and_both_are_accounted_for() -> None:
    found = diagnosed(recording(2, slope=0.5, wave=0.5))
    gap = found["gap"]
    assert gap["shrink_by_refitting"]["share"] > 0.1 and gap["shrink_by_effects"]["share"] > 0.5
    assert gap["shrink"] == pytest.approx(
        gap["shrink_by_refitting"]["share"] + gap["shrink_by_effects"]["share"], abs=1e-6
    )
    assert {source["source"] for source in found["sources"]} == {"dynamics", "actuator"}


def test_a_twin_that_fits_as_well_is_confusable_and_asks_for_another_recording() -> None:
    found = diagnosed(recording(3, step=0.1))
    (name,) = names(found)
    (rival,) = {"step", "late_step"} - {name}
    line = next(line for line in found["candidates"] if line["name"] == rival)
    assert line["status"] == "confusable" and line["confusable_with"] == [name]
    assert found["next_experiment"].startswith("2 rivals")


def test_a_small_effect_is_named_where_the_rest_is_its_own_and_not_where_only_noise_is_left_without_it() -> None:
    whole, slight = (diagnosed(recording(7, wave=10.0, step=size)) for size in (0.6, 0.06))
    assert names(whole) == {"wave", "step"} and names(slight) == {"wave"}
    assert min(effect["share"] for effect in whole["effects"]) < 0.01
    assert any("closes less" in line.get("reason", "") for line in slight["candidates"])


def test_an_effect_that_closes_little_is_not_ruled_out_where_something_is_left() -> None:
    others = frozenset({"curve", "late_step"})
    found = diagnosed(recording(7, wave=10.0, step=0.2, curve=0.3), withheld=others)
    line = next(line for line in found["candidates"] if line["name"] == "step")
    assert found["verdict"] == "partly_explained" and names(found) == {"wave"}
    assert line["status"] == "undecided" and "closes less" in line["reason"] and line["evidence"] > 100
    assert "step" in {kept["name"] for kept in found["refitted"]}  # the simulator is better with it


def test_where_no_value_is_refitted_an_effect_that_closes_little_stays_in_the_simulator_too() -> None:
    """A toss's; beside something unknown a fifth of what is left would have been enough for its name."""
    y = recording(7, wave=10.0, step=0.2, other=0.4 * np.sin(40 * np.pi * T))
    found = diagnosed(y, plain=True, refitted=Names(), withheld=frozenset(CURVES) - {"wave", "step"})
    assert found["verdict"] == "partly_explained" and names(found) == {"wave"}
    assert [kept["name"] for kept in found["refitted"]] == ["step"]
    assert next(line for line in found["candidates"] if line["name"] == "step")["status"] == "undecided"


def test_where_the_gap_is_noise_a_share_that_may_be_nothing_gets_no_name() -> None:
    for seed in range(6):
        found = diagnosed(recording(seed, wave=0.02))
        assert found["verdict"] == "no_gap" and not found["effects"]


def test_where_the_gap_is_noise_an_effect_that_few_episodes_show_plainly_has_its_name() -> None:
    shown = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    few = recording(1) + shown[:, None] * recording(0, noise=0.0, wave=0.077)
    found = diagnosed(few, shown=shown, reach=0.02)
    assert names(found) == {"wave"} and found["effects"][0]["ci"][0] < 0.01
    arm = diagnosed(few, faint=0.1, shown=shown, reach=0.02)  # whose load is another engine's
    assert not arm["effects"] and arm["verdict"] == "no_gap"


def test_an_effect_that_predictions_are_sure_of_keeps_its_name_where_the_gap_itself_is_as_loud_as_the_noise() -> None:
    class Loud(Curves):
        def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
            """A replay that hangs on a hair: noise is all of it, and by chance a little more with the effect."""
            return np.full(len(segments), self.noise**2 * (1.01 if "step" in hypothesis.values else 1.0))

        def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
            return Curves.error(self, hypothesis, segments) / self.noise**2

    it = Loud(recording(3, step=0.5))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    found = report(it, assessor, settle(it, assessor, Search(it, assessor).run()))[0]
    (step,) = found["effects"]
    assert found["verdict"] == "explained" and found["withheld"] == []
    assert step["name"] == "step" and step["patched"] is False and step["share"] == pytest.approx(1, abs=0.1)
    assert step["parameters"]["size"]["value"] == pytest.approx(0.5, abs=0.05)
    assert found["gap"]["after"] == found["gap"]["before"]  # no patch makes it worse


def test_an_effect_that_helps_in_company_alone_has_the_share_that_it_closes_there() -> None:
    found = diagnosed(recording(8, step=1.0, curve=-0.825))
    assert names(found) == {"step", "curve"}
    assert all(effect["ci"][0] > 0.01 for effect in found["effects"])


def test_what_effects_may_do_otherwise_than_their_definitions_gets_no_name() -> None:
    y = recording(7, wave=1.0, step=0.13)
    assert names(diagnosed(y)) == {"wave", "step"} and names(diagnosed(y, allowance=0.9)) == {"wave"}


def test_what_no_effect_explains_is_unexplained_and_located() -> None:
    other = 0.5 * np.exp(-(((T - 0.9) / 0.05) ** 2))
    found = diagnosed(recording(4, other=other), withheld=frozenset({"step", "late_step"}))
    assert found["verdict"] == "unexplained"
    assert not found["effects"]
    assert found["unexplained"]["where"][0]["at"] == "late"


def test_beside_something_unknown_the_simulator_is_no_worse_than_one_that_is_identified() -> None:
    """And guessed parameters are named where little is left beside them, not where others may do an unknown's work."""
    ys = [recording(4, slope=1.0, other=size * np.sin(40 * np.pi * T)) for size in (1.0, 0.2)]
    large, small = (diagnosed(y, guessed=frozenset({"slope"})) for y in ys)
    known = diagnosed(ys[1])
    assert known["verdict"] == "unexplained" and not known["effects"]
    for found in (large, small, known):
        assert found["gap"]["after"] <= found["gap"]["refitted"] < 0.9 * found["gap"]["before"]
    assert large["verdict"] == "unexplained" and large["refitted"]
    assert small["verdict"] == "partly_explained" and names(small) == {"slope"}


@pytest.mark.parametrize(("size", "named"), [(4.0, {"slope"}), (1.0, set())])
def test_a_measured_value_is_a_cause_beside_something_unknown_that_is_next_to_nothing(
    size: float, named: set[str]
) -> None:
    """What is unknown may pass for a wrong value, but leaves more of it."""
    found = diagnosed(recording(4, slope=size, other=0.2 * np.sin(40 * np.pi * T)))
    assert names(found) == named and {each["name"] for each in found["refitted"]} == {"offset", "slope"} - named


def test_of_two_guessed_parameters_that_say_the_same_one_is_named_and_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside each other neither is known to differ from what was guessed: a weight and a constant torque of a servo."""

    class Alike(Curves):
        def intervals(self, hypothesis: Hypothesis) -> dict[str, dict[str, tuple[float, float]]]:
            self.reach = 0.6 if {"offset", "slope"} <= hypothesis.values.keys() else 0.1
            return super().intervals(hypothesis)

    monkeypatch.setitem(CURVES, "slope", 1 + 0.3 * (2 * T - 1))
    y = recording(4, offset=0.5, slope=0.5, other=0.4 * np.sin(40 * np.pi * T))
    it = Alike(y, guessed=frozenset({"offset", "slope"}))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    found = report(it, assessor, settle(it, assessor, Search(it, assessor).run()))[0]
    assert len(names(found)) == 1 and found["gap"]["after"] < 1.05 * found["gap"]["refitted"]
    low, high = found["effects"][0]["parameters"]["size"]["ci"]
    assert 0 < low < 1 < high
    other = next(line for line in found["candidates"] if line["name"] in {"offset", "slope"} - names(found))
    assert other["status"] == "confusable" and set(other["confusable_with"]) == names(found)


def test_where_something_is_left_every_nominal_parameter_is_as_the_data_ask_for() -> None:
    """What little the recording shows of it is still the best there is: it was put back to its nominal value."""
    y = recording(4, wave=1.0, slope=0.05, offset=0.018, other=np.sin(40 * np.pi * T))
    for hidden in ({}, {"offset": "nothing shows it"}):
        found = diagnosed(y, not_excited=hidden)
        assert names(found) == {"wave"} and {each["name"] for each in found["refitted"]} == {"offset", "slope"}


def test_a_refitted_value_without_a_name_is_undecided_and_one_that_nothing_asks_for_is_absent() -> None:
    other = np.sin(40 * np.pi * T)
    off, believed = (diagnosed(recording(4, wave=1.0, slope=size, other=other)) for size in (0.5, 0.0))
    off, believed = (next(line for line in found["candidates"] if line["name"] == "slope") for found in (off, believed))
    assert off["status"] == "undecided" and "refitted" in off["reason"] and off["evidence"] > 50
    assert believed["status"] == "absent" and "reason" not in believed


def test_beside_guesses_and_something_unknown_a_name_closes_half_of_what_is_left_without_it() -> None:
    """Else what it brings on held-out parts of this recording may be lost on another."""
    other = np.sin(40 * np.pi * T)
    for size, expected in ((0.6, set()), (2.0, {"wave"})):
        found = diagnosed(recording(4, wave=size, other=other), guessed=frozenset({"slope"}))
        assert names(found) == expected and found["gap"]["after"] <= found["gap"]["refitted"]


def test_beside_guesses_and_something_unknown_a_large_share_that_may_be_nothing_is_undecided() -> None:
    """It stays in a servo's simulator; a known drive's effect that few stretches show has its name."""
    shown = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    y = recording(4, other=np.sin(40 * np.pi * T)) + shown[:, None] * recording(0, noise=0.0, wave=4.0)
    known, servo = (diagnosed(y, guessed=frozenset(guessed), shown=shown) for guessed in ((), ("slope",)))
    assert names(known) == {"wave"} and known["effects"][0]["ci"][0] < 0.01
    assert not names(servo) and servo["gap"]["after"] == known["gap"]["after"]
    assert next(each["status"] for each in servo["candidates"] if each["name"] == "wave") == "undecided"


def test_what_free_runs_of_several_motions_are_better_with_stays_in_the_simulator_unnamed() -> None:
    """Of one motion, stretches would take what is wrong on another."""
    y = recording(6, wave=0.6, other=np.sin(40 * np.pi * T))
    one, several = (diagnosed(y, guessed=frozenset({"slope"}), motions=count) for count in (1, 6))
    assert names(one) == names(several) == set()
    assert several["gap"]["after"] < 0.92 * one["gap"]["after"]
    kept = [{each["name"] for each in found["refitted"]} for found in (one, several)]
    assert "wave" not in kept[0] and "wave" in kept[1]
    assert next(line for line in several["candidates"] if line["name"] == "wave")["status"] == "undecided"


@pytest.mark.parametrize(
    ("truth", "named"),
    [
        ({"step": 0.5}, {"step"}),
        ({"step": 0.5, "wave": 0.5}, {"step", "wave"}),
        ({"step": 0.5, "wave": 0.5, "slope": 0.3}, {"late_step", "wave"}),
    ],
)
def test_beside_guesses_one_name_or_two_take_the_place_of_more_where_they_are_as_good(
    truth: dict[str, float], named: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    it = Curves(recording(1, **truth), guessed=frozenset({"offset", "slope"}))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    search, base = Search(it, assessor), assessor.one(it.refitted)
    several = assessor.one(it.refitted | {"late_step", "wave"})  # what a search may end with
    end = Found(several, base, assessor.one(frozenset()), base, frozenset({"late_step", "wave"}), Names(), (), True)
    monkeypatch.setattr(search, "_searched", lambda: end)
    assert search.run().effects == named


def test_a_simulator_that_leaves_nothing_is_where_a_search_goes_on_unless_it_is_a_coincidence() -> None:
    it = Curves(recording(1, wave=0.5, slope=0.3))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    search = Search(it, assessor)

    def resumed(*more: str, hardly: bool = False) -> Names | None:
        found = search.resumed(assessor.one(it.refitted | {*more}), hardly)
        return found.effects if found else None

    assert resumed("wave", "step") == {"wave", "slope"}  # what is not needed goes
    assert resumed("step") is None and resumed("wave", *DISCREPANCIES) is None  # something is left, or unknown
    assert resumed("step", hardly=True) == {"step"}  # next to nothing of the gap
    it.y = recording(1, wave=0.5, slope=0.3, curve=0.4)
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    search = Search(it, assessor)
    assert resumed("wave", "curve") is None


def test_a_known_effect_beside_an_unknown_one_keeps_its_name() -> None:
    other = 0.5 * np.sin(40 * np.pi * T)
    found = diagnosed(recording(5, wave=0.5, other=other))
    assert found["verdict"] == "partly_explained"
    assert names(found) == {"wave"}
    assert 0.3 < found["unexplained"]["share"] < 0.7
    guess = {"guessed": frozenset({"slope"}), "reach": 0.45}  # who knows how large anything is
    assert not diagnosed(recording(5, wave=0.5, other=other), **guess)["effects"]


def test_effects_that_leave_no_more_without_the_unknown_are_in_the_simulator_as_they_are_without_it() -> None:
    """Beside it they share their work with it, and a free run has nothing unknown."""
    it = Curves(recording(1, wave=0.5, curve=0.4))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    base, effects, unknown = it.refitted, frozenset({"wave", "curve"}), frozenset(DISCREPANCIES)
    bare, final = assessor.one(base), assessor.one(base | effects | unknown)
    found = Found(final, bare, assessor.one(frozenset()), bare, effects, unknown, tuple(unknown), True)
    simulator = simulator_at_end(it, assessor, found, effects)
    assert simulator.names == base | effects and simulator.error.mean() < 1.1 * it.noise**2
    assert simulator.hypothesis.values["curve"]["size"] == pytest.approx(0.4, abs=0.05)


@pytest.mark.parametrize(("size", "named", "stays"), [(0.25, False, False), (0.25, True, True), (1.0, False, True)])
def test_an_effect_without_a_name_stays_in_the_simulator_where_it_helps(size: float, named: bool, stays: bool) -> None:
    """One with a name has to do no harm."""
    it = Curves(recording(1, wave=size, other=np.sin(40 * np.pi * T)))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    bare, final, wave = assessor.one(it.refitted), assessor.one(it.refitted | {"wave"}), frozenset({"wave"})
    found = Found(final, bare, assessor.one(Names()), bare, wave if named else Names(), Names(), (), False)
    assert ("wave" in simulator_at_end(it, assessor, found, Names()).names) == stays


@pytest.mark.parametrize("fleeting", [True, False])
def test_what_another_recording_may_show_none_of_is_in_no_simulator(fleeting: bool) -> None:
    class Fleeting(Curves):
        def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
            return fleeting

    it = Fleeting(recording(4, wave=1.0, other=np.sin(40 * np.pi * T)))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    found = report(it, assessor, settle(it, assessor, Search(it, assessor).run()))[0]
    assert names(found) == (set() if fleeting else {"wave"})
    assert {each["name"] for each in found["refitted"]} == {"offset", "slope"}


@pytest.mark.parametrize("guessed", [True, False])
def test_a_gain_takes_the_place_of_what_is_known_and_not_of_a_guess(guessed: bool) -> None:
    """Though this recording is better with it: others were worse."""

    class Scaled(Curves):
        def simplify(self, names: Names) -> list[Names]:
            return [names - {"slope"} | {"curve"}]

    y = recording(1, curve=2.0, other=np.sin(40 * np.pi * T))
    it = Scaled(y, guessed=frozenset({"slope"}) if guessed else Names())
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    bare = assessor.one(it.refitted)
    found = Found(bare, bare, assessor.one(Names()), bare, Names(), Names(), (), False)
    assert ("curve" in simulator_at_end(it, assessor, found, Names()).names) != guessed


def test_an_effect_whose_work_an_unknown_does_is_undecided_and_one_that_nothing_asks_for_is_absent() -> None:
    found = diagnosed(recording(5, wave=1.0, other=2.0 * np.cos(4 * np.pi * T)), known=True, beside=True)
    status = {line["name"]: line["status"] for line in found["candidates"]}
    assert found["verdict"] == "partly_explained" and names(found) == {"wave"}
    assert status["step"] == "undecided" and status["slope"] == "absent"


def test_a_name_that_brings_nothing_beside_something_unknown_goes() -> None:
    """Without the unknown it would close much: the search met it first."""
    y = recording(5, wave=1.0, other=np.cos(2 * np.pi * T) + np.cos(4 * np.pi * T) + 0.3 * np.sin(40 * np.pi * T))
    it = Curves(y, refitted=Names())
    assessor, both = Assessor(it, SearchConfig(), jobs=1, seed=0), frozenset({"wave", "curve"})
    unknown, nominal = frozenset(DISCREPANCIES), assessor.one(Names())
    found = Found(assessor.one(both | unknown), nominal, nominal, nominal, both, unknown, (), False)
    assert settle(it, assessor, found).found.effects == {"wave"}


def test_what_goes_with_a_stand_in_is_not_held_against_a_name_of_the_same_size_without_it() -> None:
    """Where it differs, or looks wrong beside the stand-in as well, it is one itself."""
    y = recording(5, wave=0.5, curve=0.6, other=0.5 * np.sin(40 * np.pi * T))
    hidden = {"discrepancies": {}, "standing": {"curve": frozenset({"wave"})}}
    assert names(diagnosed(y, **hidden)) == set()
    assert names(diagnosed(y, beside=True, **hidden)) == {"wave"}
    both = {"discrepancies": {}, "standing": {"curve": frozenset({"wave"}), "wave": frozenset()}}
    assert names(diagnosed(y, beside=True, **both)) == set()


def test_an_effect_that_does_what_an_unknown_cannot_stands_beside_it() -> None:
    """Though the unknown alone is a better story than the effects alone."""
    y = recording(5, step=2.0, other=np.cos(7 * np.pi * T))
    assert "step" not in names(diagnosed(y))
    found = diagnosed(y, beside=True)
    assert names(found) == {"step"} and found["verdict"] == "partly_explained"


def test_an_effect_that_does_most_of_what_an_unknown_leaves_stands_though_its_form_is_too_coarse_for_the_rest() -> None:
    unknown = 3 * np.cos(3 * np.pi * T)
    assert names(diagnosed(recording(5, step=1.0, other=unknown + 0.06 * np.sin(40 * np.pi * T)), known=True)) == {
        "step"
    }
    assert not names(diagnosed(recording(5, step=0.1, other=unknown + 0.2 * np.sin(40 * np.pi * T)), known=True))


def test_an_unknown_that_bears_out_some_of_the_effects_takes_the_place_of_the_others() -> None:
    """Be it that they leave much more than it does, or that it leaves nothing and they are more."""
    more = recording(5, step=2.0, other=np.cos(2 * np.pi * T) + 0.06 * np.sin(40 * np.pi * T))
    assert names(diagnosed(more, known=True, beside=True)) == {"step"}
    smooth = DISCREPANCIES["anything smooth"].T
    unknown = smooth @ np.linalg.lstsq(smooth, 0.2 * np.cos(2 * np.pi * T) + 0.2 * CURVES["step"], rcond=None)[0]
    assert names(diagnosed(recording(5, wave=1.0, other=unknown), known=True, beside=True)) == {"wave"}


def test_stand_ins_that_only_miss_each_other_beside_an_unknown_have_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a fit in turn one of them alone may be worse than both, and than none."""
    fit, pair = Curves.fit, {"wave", "step"}

    def in_turn(self: Curves, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        found = fit(self, names, segments, start)
        if len(names & pair) == 1 and found.extra:
            return Hypothesis(
                {name: {"size": value["size"] + 0.5} for name, value in found.values.items()}, found.extra
            )
        return found

    monkeypatch.setattr(Curves, "fit", in_turn)
    smooth = DISCREPANCIES["anything smooth"].T
    unknown = smooth @ np.linalg.lstsq(smooth, CURVES["wave"] + CURVES["step"], rcond=None)[0]
    assert not names(diagnosed(recording(5, other=unknown), known=True, beside=True))


def test_the_little_that_an_unknowns_knots_are_too_coarse_for_has_no_name_beside_it() -> None:
    y = np.concatenate([recording(seed, step=0.1, other=np.cos(3 * np.pi * T)) for seed in range(20)])
    it = Curves(y)
    assessor = Assessor(it, SearchConfig(known=True, beside=True), jobs=1, seed=0)
    unknown = assessor.one(frozenset(DISCREPANCIES))
    gain = assessor.gain(assessor.one(unknown.names | {"step"}), unknown)
    assert gain.nats > assessor.cfg.promising and gain.relief < assessor.cfg.relief
    assert Search(it, assessor)._known_beside(unknown) is None


def test_where_a_proposed_set_leaves_nothing_no_rivals_of_its_size_are_grown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Curves, "proposals", lambda self: [frozenset({"wave"})])
    assessed = []
    for hidden in (True, False):
        assessor = Assessor(Curves(recording(5, wave=0.5)), SearchConfig(hidden=hidden), jobs=1, seed=0)
        assert Search(assessor.case, assessor).run().effects == {"wave"}
        assessed.append(len(assessor.assessed))
    assert assessed[1] < assessed[0]


def test_a_small_rest_is_explained_only_beside_an_effect_of_a_rough_form() -> None:
    y = recording(9, wave=2.0, other=0.15 * np.sin(40 * np.pi * T))
    assert diagnosed(y)["verdict"] == "partly_explained"
    assert diagnosed(y, rough=frozenset({"wave"}))["verdict"] == "explained"


def test_a_withheld_effect_is_not_replaced_by_several_others() -> None:
    found = diagnosed(recording(6, curve=1.0), withheld=frozenset({"curve"}))
    assert found["verdict"] == "unexplained"
    assert found["unexplained"]["resembles"] == ["a smooth curve"]


def test_silent_effects_are_not_excited_and_certain_ones_always_present() -> None:
    found = diagnosed(recording(7, wave=0.5), not_excited={"step": "no late samples"}, certain={"wave": 1e3})
    status = {line["name"]: line["status"] for line in found["candidates"]}
    assert status["step"] == "not_excited" and status["wave"] == "present"


def test_the_same_seed_gives_the_same_report() -> None:
    y = recording(8, wave=0.2, slope=0.1)
    assert diagnosed(y) == diagnosed(y)


@pytest.mark.parametrize("name", ["step", "offset"])
@pytest.mark.parametrize(("reach", "named"), [(0.2, True), (0.6, False)])
def test_what_may_be_as_the_simulator_had_it_has_no_name(name: str, reach: float, named: bool) -> None:
    """An effect, or a nominal value."""
    report = diagnosed(recording(3, **{name: 0.5}), reach=reach)
    assert [effect["name"] for effect in report["effects"]] == [name] * named


def test_a_cause_is_stated_beside_a_name_that_no_free_run_holds() -> None:
    it = Curves(recording(1, slope=3.0, wave=0.3), guessed=frozenset({"slope"}))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    settled = settle(it, assessor, Search(it, assessor).run())
    assert settled.found.effects == {"slope", "wave"}
    base = assessor.one(it.refitted)  # a simulator that is better without the wave, as one beside something unknown
    found = replace(settled.found, effects=frozenset({"wave"}))
    without = replace(settled, found=found, simulator=simulator_of(it, assessor, base, base.names))
    stated = _with_causes(it, assessor, without, it.guessed)
    assert stated.found.effects == {"slope", "wave"}
    assert all(name in stated.source(name)[0].values for name in stated.found.effects)


def test_a_set_is_fitted_again_from_a_likelier_fit_of_fewer_names() -> None:
    class Stuck(Curves):
        """Whose fit from nothing ends in an optimum that is none, but for a single name."""

        def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
            found = super().fit(names, segments, start)
            if len(names) > 1 and not (start and any(each["size"] for each in start.values.values())):
                return replace(found, values={name: {"size": 0.0} for name in found.values})
            return found

    assessor = Assessor(Stuck(recording(1, wave=0.5, curve=0.4)), SearchConfig(), jobs=1, seed=0)
    pair = frozenset({"wave", "curve"})
    stuck = assessor.one(pair).score
    single = assessor.one(frozenset({"wave"}))
    assert assessor.one(pair, single.hypothesis).score > max(stuck, single.score) + 10


@pytest.mark.parametrize(("step", "verdict"), [(3.0, "explained"), (0.3, "partly_explained")])
def test_a_rough_form_is_to_blame_for_little_of_what_it_does_and_for_no_more(step: float, verdict: str) -> None:
    y = recording(7, wave=10.0, step=step) + 0.3 * np.sin(37 * np.pi * T)  # which no name is
    found = diagnosed(y, rough=frozenset({"step"}), discrepancies={})
    assert found["verdict"] == verdict
    assert ("step" in names(found)) == (verdict == "explained")  # a hundredth of the gap is no name beside a rest


def test_what_something_unknown_resembles_is_said_in_the_order_of_what_each_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ripple = np.stack([np.sin(40 * np.pi * T), np.cos(40 * np.pi * T)])
    monkeypatch.setitem(DISCREPANCIES, "a ripple", ripple)
    both = {"a ripple": "a ripple", "anything smooth": "a smooth curve"}
    for smooth, fine in ((1.0, 0.4), (0.4, 1.0)):
        it = Curves(recording(6, other=smooth * np.cos(3 * np.pi * T) + fine * ripple[0]))
        it.discrepancies = both
        found = Search(it, Assessor(it, SearchConfig(), jobs=1, seed=0)).run()
        assert found.resembles == tuple(sorted(both, reverse=smooth > fine))


@pytest.mark.parametrize(("other", "named"), [(0.2, {"wave"}), (1.0, set())])
def test_free_runs_name_what_leaves_next_to_nothing_of_what_is_left_without_a_name(
    other: float, named: set[str]
) -> None:
    it = Curves(recording(4, wave=2.0, other=other * np.sin(40 * np.pi * T)))
    assessor = Assessor(it, SearchConfig(), jobs=1, seed=0)
    search, base = Search(it, assessor), assessor.one(it.refitted)
    assessor.one(it.refitted | {"wave"})  # what a search may have tried
    unknown = assessor.one(it.refitted | Names(it.discrepancies))
    nothing = Found(unknown, base, assessor.one(frozenset()), base, Names(), Names(it.discrepancies), (), False)
    settled = by_free_runs(it, assessor, search, settle(it, assessor, nothing))
    assert settled.found.effects == named


def test_to_a_coincidence_of_unknowns_none_is_added(monkeypatch: pytest.MonkeyPatch) -> None:
    """With more of them nothing would be any surer, and each is fitted beside all others."""
    waves = {f"wave {k}": np.stack([np.sin(k * np.pi * T), np.cos(k * np.pi * T)]) for k in (20, 30, 40, 50, 60)}
    for name, rows in waves.items():
        monkeypatch.setitem(DISCREPANCIES, name, rows)
    it = Curves(recording(6, other=sum(rows[0] for rows in waves.values())))
    it.discrepancies = {name: name for name in waves}
    found = Search(it, Assessor(it, SearchConfig(), jobs=1, seed=0)).run()
    assert len(found.unknown) == COINCIDENCE and not found.effects and not found.adequate
