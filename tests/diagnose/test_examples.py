"""Recordings made by another engine and other image code, whose answers are known."""

import json

import pytest
from recordings import DATA, EXAMPLES

from vision_s2r.cli import compose
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose_all
from vision_s2r.diagnose.replay import ReplayConfig, replay_all
from vision_s2r.diagnose.simulator import BETTER
from vision_s2r.hardware.machines import machines

REAL = DATA.parents[2] / "shared" / "real"  # logs of real machines, not ours to give away
JOINTS = ("Elbow", "Jaw", "Pitch", "Rotation", "Wrist_Pitch", "Wrist_Roll")
MACHINES = ("emps", "sts3250", *(f"so101/{joint}" for joint in JOINTS))
SLOW = ("joint_no_gap", "joint_backlash", "camera_defocus_blur", "camera_lens_distortion")


@pytest.mark.parametrize(
    "name",
    [
        "joint_viscous_damping",
        "camera_no_gap",
        *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW),
    ],
)
def test_the_answer_and_nothing_else(name, tmp_path):
    answer = json.loads((EXAMPLES / name / "answer.json").read_text())
    (path,) = diagnose_all(
        compose(DiagnoseConfig, "diagnose", [f"recording={EXAMPLES / name}", f"out={tmp_path}", "jobs=1"])
    )
    report = json.loads((path.parent / "report.json").read_text())
    assert report["verdict"] == ("explained" if answer["effects"] else "no_gap")
    assert {effect["name"] for effect in report["effects"]} == set(answer["effects"])
    for effect in report["effects"]:
        for key, truth in answer["effects"][effect["name"]].items():
            assert effect["parameters"][key]["value"] == pytest.approx(truth, rel=0.03)
    if name.startswith("joint"):
        assert replayed(EXAMPLES / name, path.parent / "report.json", tmp_path) == pytest.approx(
            {key: report["gap"][key] for key in ("before", "after")}, rel=1e-12
        )


@pytest.mark.slow
@pytest.mark.timeout(1800)  # five logs each
@pytest.mark.skipif(not REAL.exists(), reason=f"{REAL} is not there")
@pytest.mark.parametrize("name", MACHINES)
def test_reports_of_a_real_joint_replay_to_the_digit_and_are_no_worse_than_identification(name, tmp_path):
    machine = {each.name: each for each in machines(REAL, tmp_path / "recordings")}[name]
    for motion, recording in machine.recordings.items():
        (path,) = diagnose_all(DiagnoseConfig(recording=str(recording), out=str(tmp_path / motion), jobs=1))
        report = path.parent / "report.json"
        gap = json.loads(report.read_text())["gap"]
        again = replayed(recording, report, tmp_path / motion)
        assert again == pytest.approx({key: gap[key] for key in again}, rel=1e-12), motion
        assert gap["after"] <= min(gap["before"], gap["refitted"] / BETTER), motion


def replayed(recording, report, folder):
    """The gap of a recording before and after its own report, by the command."""
    (path,) = replay_all(
        compose(ReplayConfig, "replay", [f"recording={recording}", f"report={report}", f"out={folder / 'replay'}"])
    )
    gap = json.loads(path.read_text())["gap"]
    return {key: gap[key] for key in ("before", "after")}
