"""Arms: which joint has what, the payload of all, and reports that replay."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from recordings import an_arm, played

from vision_s2r.diagnose.arm import _settle, diagnose_arm
from vision_s2r.diagnose.arm_commands import commands
from vision_s2r.diagnose.arm_look import likely
from vision_s2r.diagnose.arm_report import _Errors, report
from vision_s2r.diagnose.arm_torque import torques
from vision_s2r.diagnose.config import DiagnoseConfig, SearchConfig
from vision_s2r.diagnose.replay import replay
from vision_s2r.fit.arm.free_run import FreeRuns, free_run, heights
from vision_s2r.fit.arm.payload import PayloadForm
from vision_s2r.fit.arm.problems import motions, problems
from vision_s2r.fit.arm.whole import WholeFit
from vision_s2r.fit.case import Experiment
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.patch.arm import mjcf
from vision_s2r.report.page import html
from vision_s2r.report.reading import diagnosed, read_report, values

# A small search among a dozen effects: the search itself has tests of its own.
SLOW = ("backlash", "compliance", "cogging", "load_dependent_stribeck", "stribeck_friction", "torque_speed_limit")
SEARCH = SearchConfig(breadth=3, beam=1, contenders=1, most=1, folds=2)
QUICK = DiagnoseConfig(joint=SEARCH, withhold=[*SLOW, "thermal_drift", "asymmetric_friction"])


def test_an_effect_is_named_with_its_joint_and_the_report_replays_to_the_digit(tmp_path):
    recording = an_arm({"elbow": {"latency": {"delay": 0.02}}})
    done = diagnose_arm(recording, QUICK)
    done.save(tmp_path / "report")
    report = read_report(tmp_path / "report" / "report.json")
    assert [(each["joint"], each["name"]) for each in report["effects"]] == [("elbow", "latency")]
    assert report["verdict"] == "explained" and report["joints"]["shoulder"]["verdict"] == "no_gap"
    assert report["effects"][0]["parameters"]["delay"]["value"] == pytest.approx(0.02, rel=0.02)
    assert report["tip"]["after"] < 0.1 * report["tip"]["before"]
    again = replay(recording, values(diagnosed(report)), tmp_path, held_out=report["held_out"])
    assert again["gap"]["before"] == report["gap"]["before"] and again["gap"]["after"] == report["gap"]["after"]
    assert again["gaps"]["tip"] == {key: report["tip"][key] for key in ("unit", "before", "after")}
    (share,) = report["tip"]["shares"]
    assert share["of"] == "elbow" and share["share"] == pytest.approx(
        1 - (report["tip"]["after"] / report["tip"]["before"]) ** 2, abs=0.02
    )
    head = (tmp_path / "replay.csv").read_text().splitlines()[0]
    assert head.startswith("episode,t,position.shoulder_measured,position.shoulder_before,position.shoulder_after")
    page = (tmp_path / "report" / "report.html").read_text()
    assert "elbow: latency" in page and "Joint by joint" in page
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "report" / "patch" / "patched.xml"))
    assert model.nu == 2 and model.actuator_forcerange[0, 1] == 15
    moved = played(model, recording)
    assert np.abs(moved - recording.position[0]).max() < 0.1 * np.abs(free_run(recording, {})[0, ..., 0] - moved).max()


def test_a_constant_torque_is_named_where_it_explains_all():
    pulled = an_arm({"elbow": {"bias_torque": {"value": 0.4}}})
    report = diagnose_arm(pulled, QUICK).to_dict()
    assert [(each["joint"], each["name"]) for each in report["effects"]] == [("elbow", "bias_torque")]
    assert report["effects"][0]["parameters"]["value"]["value"] == pytest.approx(0.4, rel=0.02)


@pytest.mark.slow
def test_a_constant_torque_is_no_cause_where_a_friction_that_no_name_is_leaves_something():
    both = {"bias_torque": {"value": 0.4}, "stribeck_friction": {"static": 1.2, "velocity": 0.1}}
    left = diagnose_arm(an_arm({"elbow": both}), QUICK).to_dict()
    assert left["joints"]["elbow"]["verdict"] in ("partly_explained", "unexplained")
    assert "bias_torque" not in [each["name"] for each in left["effects"]]
    line = next(each for each in left["candidates"] if (each["joint"], each["name"]) == ("elbow", "bias_torque"))
    assert line["status"] == "undecided"


def test_a_payload_is_found_over_all_joints_and_a_right_arm_has_no_gap(tmp_path):
    payload = {"mass": 0.15, "x": 0.05, "y": 0.0, "z": 0.02}
    report = diagnose_arm(an_arm(whole={"payload": payload}), QUICK).to_dict()
    (effect,) = report["effects"]
    assert effect["name"] == "payload" and "joint" not in effect and report["verdict"] == "explained"
    assert effect["parameters"]["mass"]["value"] == pytest.approx(0.15, rel=0.003)
    low, high = effect["parameters"]["y"]["ci"]  # along the axes of both joints: nothing shows it
    assert low < -1 and high > 1
    nothing = diagnose_arm(an_arm(), QUICK).to_dict()
    assert nothing["verdict"] == "no_gap" and not nothing["effects"]
    assert json.dumps(nothing, allow_nan=False)


def test_a_tilted_base_is_found_over_all_joints_and_is_gravity_in_the_patch(tmp_path):
    arm = an_arm(whole={"base_tilt": {"roll": 0.0, "pitch": 0.06}})
    done = diagnose_arm(arm, replace(QUICK, withhold=[*QUICK.withhold, "position_offset"]))
    report = done.to_dict()
    (effect,) = report["effects"]
    assert effect["name"] == "base_tilt" and "joint" not in effect and report["verdict"] == "explained"
    assert effect["parameters"]["pitch"]["value"] == pytest.approx(0.06, rel=0.03)
    done.save(tmp_path / "report")
    gravity = mujoco.MjModel.from_xml_path(str(tmp_path / "report" / "patch" / "patched.xml")).opt.gravity
    # Two joints about y hardly feel what is sideways.
    assert gravity[[0, 2]] == pytest.approx([9.81 * math.sin(0.06), -9.81 * math.cos(0.06)], rel=0.02)
    low, high = effect["parameters"]["roll"]["ci"]
    assert high - low > 0.01


def test_an_encoder_that_is_off_is_found_over_all_joints_and_is_the_reference_in_the_patch(tmp_path):
    recording = an_arm(whole={"elbow.position_offset": {"value": 0.08}})
    done = diagnose_arm(recording, QUICK)
    report = done.to_dict()
    (effect,) = report["effects"]
    assert (effect["joint"], effect["name"], report["verdict"]) == ("elbow", "position_offset", "explained")
    assert effect["parameters"]["value"]["value"] == pytest.approx(0.08, rel=0.02)
    done.save(tmp_path / "report")
    again = replay(recording, values(diagnosed(report)), tmp_path, held_out=report["held_out"])
    assert again["gap"]["after"] == report["gap"]["after"] < 0.5 * report["gap"]["before"]
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "report" / "patch" / "patched.xml"))
    assert model.qpos0[1] == pytest.approx(0.08, rel=0.02) and model.jnt_range[1, 1] == pytest.approx(2.58, abs=0.01)
    plain = mujoco.MjModel.from_xml_string(mjcf({}, recording))
    moved = played(model, recording) - played(plain, recording)
    asked = (free_run(recording, values(diagnosed(report))) - free_run(recording, {}))[0, ..., 0]
    assert np.abs(moved - asked).mean() < 0.1 * np.abs(asked).mean()


@pytest.mark.slow
def test_two_joints_that_are_off_are_found_together_and_the_first_is_said_to_be_one_with_a_tilted_base():
    off = {"shoulder.position_offset": {"value": -0.06}, "elbow.position_offset": {"value": 0.08}}
    report = diagnose_arm(an_arm(whole=off), QUICK).to_dict()
    named = {f"{each['joint']}.{each['name']}": each["parameters"]["value"]["value"] for each in report["effects"]}
    assert named == {name: pytest.approx(each["value"], abs=2e-3) for name, each in off.items()}
    assert sum(each["share"] for each in report["effects"]) == pytest.approx(1, abs=0.02)
    tilt = next(line for line in report["candidates"] if line["name"] == "base_tilt")
    assert tilt["status"] == "undecided" and tilt["confusable_with"] == ["shoulder.position_offset"]


@pytest.mark.slow
def test_an_encoder_that_is_off_is_found_beside_a_payload_that_does_most_of_its_work():
    there = {"payload": {"mass": 0.15, "x": 0.1, "y": 0.0, "z": 0.0}, "shoulder.position_offset": {"value": 0.06}}
    report = diagnose_arm(an_arm(whole=there), QUICK).to_dict()
    found = {each["name"]: each["parameters"] for each in report["effects"]}
    assert report["verdict"] == "explained" and found.keys() == {"payload", "position_offset"}
    assert found["payload"]["mass"]["value"] == pytest.approx(0.15, rel=0.02)
    assert found["position_offset"]["value"]["value"] == pytest.approx(0.06, abs=4e-3)


def test_a_small_tilt_shows_in_a_log_whose_rows_are_as_slow_as_its_motion():
    arm = an_arm(whole={"base_tilt": {"roll": 0.0, "pitch": 0.02}}, seconds=8.0, rate=30)
    assert FreeRuns(arm).noise == pytest.approx(2e-4, rel=0.2)
    done = diagnose_arm(arm, replace(QUICK, withhold=[*QUICK.withhold, "position_offset"])).to_dict()
    assert [each["name"] for each in done["effects"]] == ["base_tilt"] and done["verdict"] == "explained"
    assert 1.5 * done["gap"]["floor"] < done["gap"]["before"] < 5 * done["gap"]["floor"]


def test_an_encoder_of_steps_so_coarse_that_most_rows_are_alike_is_not_taken_for_one_without_noise():
    arm = an_arm(whole={"payload": {"mass": 0.15, "x": 0.05, "y": 0.0, "z": 0.02}}, noise=0.0)
    joints = {name: replace(joint, position=np.round(2 * joint.position) / 2) for name, joint in arm.joints.items()}
    coarse = replace(arm, joints=joints)
    before = WholeFit(FreeRuns(coarse), motions(FreeRuns(coarse), {}), PayloadForm(), {}).before
    assert (before < 10).all()


def test_what_torque_columns_are_beside_the_simulator_is_said():
    recording = an_arm()
    law = {
        name: np.clip(joint.nominal["proportional_gain"] * (joint.command - joint.position), -15, 15)
        for name, joint in recording.joints.items()
    }
    logged = {"shoulder": 0.6 * law["shoulder"], "elbow": np.abs(law["elbow"])}
    found = torques(FreeRuns(replace(recording, torque=logged)), {}, 0)
    assert found["shoulder"]["of_law"]["factor"] == pytest.approx(0.6, abs=0.001)
    assert found["shoulder"]["of_bodies"]["factor"] == pytest.approx(0.6, rel=0.03)
    assert "0.6 times (0.6 to 0.6) what the drive's law gives" in found["shoulder"]["said"]
    assert "never changes its sign" in found["elbow"]["said"]
    assert torques(FreeRuns(recording), {}, 0) == {}
    page = html(diagnose_arm(replace(recording, torque=logged), QUICK).to_dict(), {})
    assert "torque.shoulder" in page and "a current without a sign?" in page


def test_the_next_recording_stays_within_the_limits_of_the_joints():
    recording = an_arm(seconds=1.0)
    t = np.arange(100) * 0.01
    asked = Experiment("", {"episode": 0 * t, "t": t, "target": 3.0 * np.sin(6 * t)})
    parts = {name: SimpleNamespace(recording=each, experiment=asked) for name, each in recording.joints.items()}
    table = commands(parts, recording)
    assert list(table) == ["episode", "t", "command.shoulder", "command.elbow"] and table["episode"].max() == 1
    assert np.abs(table["command.elbow"]).max() == 2.5


def test_the_next_recording_keeps_the_tip_as_high_as_it_has_been():
    recording = an_arm(seconds=1.0)
    near = {name: replace(joint, position=0.3 * joint.position) for name, joint in recording.joints.items()}
    recording = replace(recording, joints=near)
    t = np.arange(100) * 0.01
    asked = Experiment("", {"episode": 0 * t, "t": t, "target": 3.0 * np.sin(6 * t)})
    parts = {name: SimpleNamespace(recording=each, experiment=asked) for name, each in recording.joints.items()}
    table = commands(parts, recording)
    goals = np.stack([table["command.shoulder"], table["command.elbow"]], axis=1)
    lowest = heights(recording, recording.position).min()
    rest = np.median(goals, axis=0)
    asked_of_shoulder = np.stack([3.0 * np.sin(6 * t), np.full(len(t), rest[1])], axis=1)
    assert heights(recording, asked_of_shoulder).min() < lowest
    assert heights(recording, goals).min() >= lowest and np.ptp(goals, axis=0).min() > 0.5


def test_a_first_look_brings_the_simulated_arm_near_the_measured_one():
    """Loads are then sharp where commands step; by measured accelerations alone they are blurred, and no name fits."""
    runs = FreeRuns(an_arm({"elbow": {"viscous_damping": {"value": 2.5}}}, seconds=2.0))
    made = problems(runs.recording, motions(runs, {}), {})
    near, now, case = likely(runs, made, "elbow", {}, {}, QUICK, 1)
    assert runs.error("elbow", {}) > 100 * 2e-4**2
    assert runs.error("elbow", near) < 1.2 * 2e-4**2
    assert case is None and now is not made  # what was opened is of the problem before
    of_no_use = DiagnoseConfig(withhold=[each.name for each in JOINT_EFFECTS if each.name != "deadband"])
    near, now, case = likely(runs, made, "elbow", {}, {}, of_no_use, 1)
    assert near == {} and now is made and case.recording is made.joints["elbow"]


@pytest.mark.parametrize(
    ("before", "after", "closed"),
    [(1.05, 1.05, True), (4.0, 1.3, False), (1000.0, 6.0, True), (1000.0, 20.0, False), (1e6, 100.0, False)],
)
def test_a_joints_gap_is_closed_where_next_to_nothing_is_left_and_that_near_the_noise(before, after, closed):
    squares = [np.full((3, 1), each) for each in (before, before, after, 1.0)]
    assert _Errors(*squares, tip=None, seed=0).closed(0, adequate=0.1) is closed


@pytest.mark.slow
def test_a_gap_that_refitted_values_close_without_a_name_is_not_called_none():
    runs = FreeRuns(an_arm({"elbow": {"viscous_damping": {"value": 2.5}}}))
    settled = _settle(runs, QUICK, 1)
    found = settled.parts["elbow"]
    nameless = found.to_dict() | {"verdict": "unexplained", "effects": []}
    kept = {name: getattr(found, name) for name in ("recording", "experiment", "case", "settled")}
    parts = settled.parts | {"elbow": type(found).of(nameless, **kept)}
    said = report(runs, replace(settled, parts=parts), QUICK)
    assert said["gap"]["after"] < 0.1 * said["gap"]["before"]
    assert said["joints"]["elbow"]["verdict"] == said["verdict"] == "unexplained"
    assert said["joints"]["shoulder"]["verdict"] == "no_gap"
