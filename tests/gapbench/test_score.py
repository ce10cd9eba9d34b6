"""A benchmark from recordings to table, with diagnoses of known quality."""

import hashlib
import json
import sys
from pathlib import Path

import pytest

from vision_s2r.cli import compose
from vision_s2r.errors import UserError
from vision_s2r.gapbench.bench import bench
from vision_s2r.gapbench.config import GapbenchConfig
from vision_s2r.gapbench.score.score import Score, score
from vision_s2r.gapbench.score.table import totals

FAKE = Path(__file__).with_name("fake_diagnose.py")
COUNTS = {"null": 1, "single": 2, "pair": 1, "unknown": 1, "left_out": 1}


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("gapbench") / "drawn"
    bench(GapbenchConfig(stage="generate", counts=COUNTS, jobs=1, out=str(out)))
    return out


@pytest.fixture
def scored_by(benchmark: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Score the benchmark in a folder of its own, by a fake of this manner; returns that folder."""
    answers = json.loads((benchmark / "answers.json").read_text())
    digests = {
        hashlib.sha256((benchmark / "recordings" / name / "recording.yaml").read_bytes()).hexdigest(): entry["answer"]
        for name, entry in answers.items()
    }
    (tmp_path / "answers.json").write_text(json.dumps(digests))
    out = tmp_path / "scored"
    out.mkdir()
    for name in ("recordings", "answers.json", "commitments.json"):
        (out / name).symlink_to(benchmark / name)
    monkeypatch.setenv("ANSWERS", str(tmp_path / "answers.json"))
    monkeypatch.setenv("CALLS", str(tmp_path / "calls"))

    def score(manner: str, **keys: int) -> dict:
        monkeypatch.setenv("MANNER", manner)
        command = [sys.executable, str(FAKE)]
        bench(GapbenchConfig(stage="score", counts=COUNTS, out=str(out), diagnose=command, jobs=2, **keys))
        return json.loads((out / "results.json").read_text())

    score.out = out  # type: ignore[attr-defined]
    score.calls = tmp_path / "calls"  # type: ignore[attr-defined]
    return score


def figures(results: dict) -> dict[str, float]:
    return {row["name"]: row["value"] for row in results["totals"]}


def test_a_right_diagnosis_gets_full_marks(scored_by) -> None:
    results = scored_by("right")
    found = figures(results)
    for name in ("one effect: exact", "pairs: exact set", "source right", "verdict right"):
        assert found[name] == 1, name
    assert found["effect outside the library: unknown, no false name"] == 1
    assert found["effect left out of the library: unknown, or one declared confusable"] == 1
    assert found["false alarm, null and wrong parameters"] == 0
    assert found["median parameter error"] == pytest.approx(0.01)
    assert found["shrink over the true effect's own"] == pytest.approx(1)
    assert (scored_by.out / "confusion.png").stat().st_size > 5000
    assert (scored_by.out / "estimates.png").stat().st_size > 5000
    assert "| one effect: exact | 100 % |" in (scored_by.out / "table.md").read_text()
    table = json.loads((scored_by.out / "table.json").read_text())  # as the documentation's tables are
    assert "kind=joint set=tuning" in table["command"] and "counts.single=2" in table["command"]
    (row,) = (row for row in table["rows"] if row[0] == "one effect: exact")
    assert row[1:] == [{"value": 100, "low": 34.2, "high": 100, "unit": "%", "of": 2}, "≥ 97 %"]


def test_a_wrong_diagnosis_gets_none(scored_by) -> None:
    found = figures(scored_by("wrong"))
    assert found["one effect: exact"] == found["pairs: exact set"] == 0
    assert found["false alarm, null and wrong parameters"] == 1
    assert found["effect outside the library: unknown, no false name"] == 0
    assert found["failed"] == 0


def test_finished_reports_are_kept_and_failed_ones_tried_again(scored_by) -> None:
    assert figures(scored_by("crash", limit=2))["failed"] == 1
    assert figures(scored_by("nothing", limit=2))["failed"] == 0
    scored_by("nothing")
    assert len(scored_by.calls.read_text().splitlines()) == 2 + 6


def test_a_changed_answer_is_noticed(scored_by) -> None:
    answers = json.loads((scored_by.out / "answers.json").read_text())
    next(iter(answers.values()))["answer"]["effects"]["cogging"] = {"amplitude": 1.0, "teeth": 4.0}
    (scored_by.out / "answers.json").unlink()
    (scored_by.out / "answers.json").write_text(json.dumps(answers))
    with pytest.raises(UserError, match="not the one that was committed to"):
        scored_by("nothing")


def test_the_seal_says_nothing_of_its_answers(benchmark: Path) -> None:
    public = json.loads((benchmark / "commitments.json").read_text())
    assert len(set(public["commitments"].values())) == sum(COUNTS.values())
    names = [path.name for path in (benchmark / "recordings").iterdir()]
    assert sorted(names) == sorted(public["commitments"])
    for path in (benchmark / "recordings").rglob("*.*"):
        assert path.name in ("joint.csv", "recording.yaml")
    with pytest.raises(UserError, match="another benchmark"):
        bench(GapbenchConfig(stage="generate", counts={"null": 2}, out=str(benchmark)))


def answer(**known: object) -> dict:
    blank = {"effects": {}, "optional": {}, "equivalents": [], "unknown": None, "withhold": None, "where": []}
    return {**blank, "shrink": None, "severity": 5.0, "case": "single", **known}


def report(verdict: str, *names: str, **known: object) -> dict:
    effects = [{"name": name, "source": "actuator", "parameters": {}} for name in names]
    return {
        "verdict": verdict,
        "effects": effects,
        "candidates": [],
        "where": [],
        "gap": {"shrink": 1.0},
        **known,
    }


def scored(truth: dict, said: dict | None, kind: str = "joint") -> Score:
    return score("id", kind, truth, said, 1.0)


def test_declared_twins_count_apart_from_exact_sets() -> None:
    truth = answer(effects={"compliance": {}})
    assert scored(truth, report("explained", "compliance")).exact
    lines = [{"name": "compliance", "status": "confusable", "confusable_with": ["latency"]}]
    declared = scored(truth, report("explained", "latency", candidates=lines))
    assert declared.confusable and not declared.exact
    more = scored(truth, report("explained", "latency", "cogging", candidates=lines))
    assert not more.confusable and more.false == ["cogging", "latency"]
    assert not scored(truth, report("explained", "latency")).confusable


def test_degenerate_descriptions_of_the_same_size_are_the_same_answer() -> None:
    truth = answer(
        effects={"inertia": {}, "cogging": {}}, equivalents=[["cogging", "torque_constant"], ["a", "b", "c"]]
    )
    assert scored(truth, report("explained", "torque_constant", "cogging")).exact
    assert scored(truth, report("explained", "a", "b", "c")).confusable
    assert not scored(truth, report("explained", "cogging")).exact


def test_optional_names_are_neither_asked_for_nor_wrong() -> None:
    truth = answer(case="weak", optional={"cogging": {}})
    for said in (report("no_gap"), report("explained", "cogging")):
        assert scored(truth, said).verdict_right and not scored(truth, said).false
    assert scored(truth, report("explained", "latency")).false == ["latency"]


def test_a_place_is_right_by_its_axis_or_by_itself() -> None:
    truth = answer(effects={"cogging": {}}, where=["position", "phase: sliding"])
    for place, right in (
        ({"axis": "position", "at": "0 to 1 rad"}, True),
        ({"axis": "phase", "at": "sliding"}, True),
        ({"axis": "phase", "at": "bouncing"}, False),
    ):
        said = report("explained", "cogging") | {"where": [place]}
        assert scored(truth, said).location_right is right


def test_an_unknown_effect_with_a_false_name_beside_it_is_not_recognized() -> None:
    truth = answer(case="unknown", unknown="drag")
    assert scored(truth, report("unexplained")).recognized
    assert not scored(truth, report("partly_explained", "cogging")).recognized
    assert not scored(truth, report("no_gap")).recognized
    assert scored(truth, None).recognized is False


def test_a_known_effect_beside_an_unknown_one_may_be_undecided_but_not_absent() -> None:
    truth = answer(case="known_unknown", unknown="drag", effects={"cogging": {}})
    line = {"name": "cogging", "status": "undecided"}
    assert scored(truth, report("unexplained", candidates=[line])).denied is False
    assert scored(truth, report("unexplained", candidates=[line | {"status": "absent"}])).denied
    assert scored(truth, report("partly_explained", "cogging", candidates=[line])).denied is False
    assert scored(truth, None).denied is None


def test_angles_and_vectors_have_errors_that_mean_something() -> None:
    truth = answer(effects={"motion_blur": {"length": 8.0, "angle": 1.0}})
    angle = {"value": 179.0, "unit": "deg", "ci": [178.0, 182.0]}
    length = {"value": 8.8, "unit": "px", "ci": [8.5, 9.0]}
    said = report("explained", "motion_blur")
    said["effects"][0]["parameters"] = {"length": length, "angle": angle}
    by_name = {each.parameter: each for each in scored(truth, said, "camera").parameters}
    assert by_name["angle"].error == pytest.approx(2 / 180) and by_name["angle"].covered
    assert by_name["length"].error == pytest.approx(0.1) and not by_name["length"].covered


def test_intervals_are_wilsons() -> None:
    rows = totals("joint", [scored(answer(effects={"cogging": {}}), report("explained", "cogging"))] * 40)
    exact = next(row for row in rows if row.name == "one effect: exact")
    assert (exact.value, exact.high) == (1.0, 1.0)
    assert exact.low == pytest.approx(0.9124, abs=1e-3)
    assert exact.met


def test_the_configuration_composes_and_refuses() -> None:
    cfg = compose(GapbenchConfig, "gapbench", ["kind=camera", "set=reporting", "seed=3"])
    assert cfg.out == "outputs/gapbench/camera_reporting_3"
    assert cfg.counts["null"] > 0
    with pytest.raises(UserError, match="did you mean 'joint'"):
        bench(GapbenchConfig(kind="joints", counts={"null": 1}))
    with pytest.raises(UserError, match="no case 'singel'"):
        bench(GapbenchConfig(counts={"singel": 1}))


def test_what_a_diagnosis_asks_for_is_recorded_beside_random_commands(scored_by) -> None:
    scored_by("asks")
    command = [sys.executable, str(FAKE)]
    bench(GapbenchConfig(stage="follow", counts=COUNTS, out=str(scored_by.out), diagnose=command, jobs=2))
    table = json.loads((scored_by.out / "follow.json").read_text())
    assert "stage=follow" in table["command"]
    asking, asked, random = (row[1] for row in table["rows"][2:])
    assert asking == 3  # two singles and a pair: a null has no name, nor has what nobody taught the diagnosis
    assert (asked["value"], asked["of"]) == (100, 3) and random["value"] == 0
    lengths = {}
    for way in ("asked", "random"):
        (folder, *_) = sorted((scored_by.out / "next").glob(f"*-{way}"))
        lines = (folder / "recording" / "joint.csv").read_text().splitlines()
        lengths[way] = [sum(line.startswith(f"{k},") for line in lines) for k in range(6)]
    assert lengths["asked"] == lengths["random"] == [800] * 5 + [50]


def test_a_name_that_may_be_contents_is_told_from_one_that_is_claimed() -> None:
    answer = {"case": "content", "effects": {}, "optional": {}, "equivalents": [], "unknown": "content"}
    answer |= {"severity": None, "withhold": None, "where": [], "shrink": None}
    effect = {"name": "gamma", "source": "camera", "share": 1.0, "parameters": {}}
    report = {"verdict": "explained", "effects": [effect], "candidates": [], "where": [], "gap": {"shrink": 0.5}}
    rival = {"name": "gamma", "statistic": "tone, mean light", "shift": 0.4}
    scores = [score("a", "unpaired", answer, report | {"contents": told}, 1.0) for told in ([], [rival])]
    rows = {row.name: row.value for row in totals("unpaired", scores)}
    assert rows["contents that differ: no name"] == 0
    assert rows["contents that differ: no name, or said to be perhaps contents"] == 0.5
