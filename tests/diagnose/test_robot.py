"""A robot's folder: parts diagnosed one by one, one report over them; folders whose parts disagree."""

import json

import numpy as np
import pytest
import yaml

from tests.recordings import QUICK, a_contact
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose_all
from vision_s2r.errors import UserError
from vision_s2r.gapbench.generate import joint
from vision_s2r.recording import read, write
from vision_s2r.recording.robot import read_robot


def a_robot(folder, parts, outcomes="episode,success\n0,1\n1,0\n2,1\n"):
    """Two joints, one as its simulator has it and one with a wrong parameter, and tosses; and the parameter's name."""
    for name, case in (("joints/a", "null"), ("joints/b", "dynamics")):
        (folder / name).mkdir(parents=True)
        machine = joint.machine(case, 0, "tuning", np.random.default_rng([5, joint.CASES.index(case), 0]))
        machine.write(folder / name)
    write(a_contact(), folder / "contact")
    head = {"format": "vision-s2r/recording/1", "kind": "robot", "parts": parts}
    (folder / "recording.yaml").write_text(yaml.safe_dump(head))
    (folder / "outcomes.csv").write_text(outcomes)
    return list(machine.answer.effects)


def test_each_part_is_diagnosed_and_one_report_says_which_is_furthest_off(tmp_path):
    wrong = a_robot(tmp_path / "robot", {"joints": ["joints/a", "joints/b"]})
    diagnose_all(DiagnoseConfig(recording=str(tmp_path / "robot"), out=str(tmp_path / "out"), jobs=1, joint=QUICK))
    report = json.loads((tmp_path / "out/report.json").read_text())
    stages = {stage["part"]: stage for stage in report["stages"]}
    assert report["kind"] == "robot" and report["verdict"] == "explained" and list(stages) == ["joints/a", "joints/b"]
    assert stages["joints/a"]["verdict"] == "no_gap" and stages["joints/b"]["share"] > 0.9
    assert sum(stage["share"] for stage in stages.values()) == pytest.approx(1)
    assert stages["joints/b"]["ci"][0] <= stages["joints/b"]["share"] <= stages["joints/b"]["ci"][1]
    assert [(effect["part"], effect["name"]) for effect in report["effects"]] == [("joints/b", wrong[0])]
    alone = json.loads((tmp_path / "out/joints/b/report.json").read_text())
    assert alone["gap"] == stages["joints/b"]["gap"]
    assert report["task"]["success"] == pytest.approx(2 / 3)
    page = (tmp_path / "out/report.html").read_text()
    assert "Furthest from the simulator is joints/b" in page and 'href="joints/b/report.html"' in page


def test_every_part_is_read(tmp_path):
    a_robot(tmp_path / "robot", {"contact": "contact", "joints": ["joints/a"]})
    robot = read_robot(tmp_path / "robot")
    assert {name: part.kind for name, part in robot.parts.items()} == {"contact": "contact", "joints/a": "joint"}
    assert robot.success is not None and np.array_equal(robot.success, [True, False, True])


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({}, "parts are none, expected at least one of camera, joints, contact"),
        ({"joint": ["joints/a"]}, "did you mean 'joints'"),
        ({"joints": "joints/a"}, r"joints is 'joints/a', expected a list of folders"),
        ({"contact": ["contact"]}, "expected a folder"),
        ({"joints": ["joints/a", "joints/a"]}, "'joints/a' is there twice"),
        ({"joints": ["joints/a", "contact"]}, "kind is 'contact', but joints of the robot are 'joint'"),
        ({"contact": "../robot"}, "expected a folder inside the robot's"),
        ({"contact": "nowhere"}, "nowhere: no such folder"),
    ],
)
def test_parts_that_disagree_are_one_line(tmp_path, parts, message):
    a_robot(tmp_path / "robot", parts)
    with pytest.raises(UserError, match=message) as caught:
        read_robot(tmp_path / "robot")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("outcomes", "message"),
    [
        ("episode,success\n0,2\n", "line 2: success is 2, expected 0 or 1"),
        ("episode,success\n0,1\n0,1\n", "line 3: episode 0 is there twice"),
        ("episode,won\n0,1\n", "columns are episode, won, expected episode, success"),
    ],
)
def test_outcomes_that_are_none_are_one_line(tmp_path, outcomes, message):
    a_robot(tmp_path / "robot", {"contact": "contact"}, outcomes)
    with pytest.raises(UserError, match=message):
        read_robot(tmp_path / "robot")


def test_a_robot_is_no_single_recording(tmp_path):
    a_robot(tmp_path / "robot", {"contact": "contact"})
    with pytest.raises(UserError, match="a robot has several recordings"):
        read(tmp_path / "robot")
