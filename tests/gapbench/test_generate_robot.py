"""Generated robots: parts that are read and of the cases asked for; one report scored part by part."""

import numpy as np
import pytest

from vision_s2r.gapbench.generate import robot
from vision_s2r.gapbench.generate.base import Answer
from vision_s2r.gapbench.score.robot import score_robot, totals_of_robots
from vision_s2r.recording.robot import read_robot


def test_a_robot_is_read_and_its_answer_is_its_parts(tmp_path):
    made = robot.machine("single", 1, "tuning", np.random.default_rng([7401, 1]))
    made.write(tmp_path)
    read = read_robot(tmp_path)
    assert {name: part.kind for name, part in read.parts.items()} == {
        **{"camera": "camera", "contact": "contact"},
        **{"joints/a": "joint", "joints/b": "joint"},
    }
    parts = made.answer.parts
    assert [folder for folder, own in parts.items() if own["effects"]] == ["joints/a"]
    assert list(made.answer.effects) == [f"joints/a.{name}" for name in parts["joints/a"]["effects"]]


@pytest.mark.parametrize(("case", "wrong"), [("null", 0), ("single", 1), ("pair", 2), ("triple", 3), ("unknown", 1)])
def test_as_many_parts_are_wrong_as_the_case_says_and_all_in_turn(case, wrong):
    drawn = [robot.cases_of_parts(case, index) for index in range(12)]
    assert all(sum(own != "null" for own in parts.values()) == wrong for parts in drawn)
    assert not wrong or {folder for parts in drawn for folder in parts if parts[folder] != "null"} == {*robot.PARTS}


BACKLASH = {"backlash": {"width": 0.1}}


def an_answer(case, **parts):
    own = {"camera": Answer("null"), "joints/a": Answer("null"), "joints/b": Answer("single", BACKLASH), **parts}
    return Answer(case, {"joints/b.backlash": BACKLASH["backlash"]}, parts={k: v.to_dict() for k, v in own.items()})


def a_report(*named, **verdicts):
    width = {"width": {"value": 0.11, "unit": "rad", "ci": [0.09, 0.12]}}
    effects = [{"part": part, "name": name, "source": "actuator", "parameters": width} for part, name in named]
    of = {"camera": "no_gap", "joints/a": "no_gap", "joints/b": "explained", **verdicts}
    stages = [{"part": part, "verdict": verdict, "gap": {"shrink": 1.0}} for part, verdict in of.items()]
    return {"verdict": "explained", "stages": stages, "effects": effects}


def test_a_name_counts_only_for_the_part_that_has_it():
    answer = an_answer("single").to_dict()
    right = score_robot("id", answer, a_report(("joints/b", "backlash")), 20.0)
    assert right.exact and right.verdict_right and not right.false
    assert [(each.effect, each.covered) for each in right.parameters] == [("joints/b.backlash", True)]
    elsewhere = score_robot("id", answer, a_report(("joints/a", "backlash")), 20.0)
    assert not elsewhere.exact and elsewhere.false == ["joints/a.backlash"]
    figures = {row.name: (row.value, row.count) for row in totals_of_robots([right, elsewhere])}
    assert figures["whole robot exact"] == (0.5, 2) and figures["camera, without: exact"] == (1, 2)
    assert figures["joints, with an effect: exact"] == (0.5, 2) and figures["robots with a false name"] == (0.5, 2)


def test_an_unknown_effect_is_to_be_said_of_its_part():
    answer = an_answer("known_unknown", camera=Answer("unknown", unknown="rolling_shutter")).to_dict()
    said = score_robot("id", answer, a_report(("joints/b", "backlash"), camera="unexplained"), 20.0)
    unsaid = score_robot("id", answer, a_report(("joints/b", "backlash")), 20.0)
    assert said.recognized and said.exact and not unsaid.recognized and not unsaid.exact


def test_a_failed_diagnosis_gets_nothing_right():
    failed = score_robot("id", an_answer("single").to_dict(), None, 300.0)
    assert failed.failed and not failed.exact and not failed.verdict_right
