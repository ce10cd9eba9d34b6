"""Joints simulated by the generator's own code, diagnosed as a user would."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.identify.machines import NOMINAL, a_log, steps
from vision_s2r.cli import compose
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.locate import where
from vision_s2r.diagnose.one_case import open_case
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.gapbench.generate import joint
from vision_s2r.gapbench.generate.base import GeneratedMachine
from vision_s2r.gapbench.generate.generate import stream
from vision_s2r.gapbench.generate.unknown import UNKNOWN
from vision_s2r.joint import DYNAMICS, Tables
from vision_s2r.recording import JointRecording, read
from vision_s2r.report.reading import diagnosed


def generated(case: str, index: int, folder: Path, seed: int = 5) -> GeneratedMachine:
    found = joint.machine(case, index, "tuning", np.random.default_rng([seed, joint.CASES.index(case), index]))
    folder.mkdir(exist_ok=True)
    found.write(folder)
    return found


def reported(folder: Path, **keys: Any) -> dict[str, Any]:
    return diagnose(read(folder), replace(compose(DiagnoseConfig, "diagnose", ["recording=x"]), **keys)).to_dict()


def from_the_command_line(log: Path, out: Path) -> dict[str, Any]:
    command = [sys.executable, "scripts/diagnose.py", f"recording={log}", f"out={out}", "jobs=2"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    report: dict[str, Any] = json.loads((out / "report.json").read_text())
    return report


@pytest.mark.slow
def test_a_pair_from_the_command_line(tmp_path: Path) -> None:
    truth = generated("pair", 3, tmp_path / "log").answer.effects
    report = from_the_command_line(tmp_path / "log", tmp_path / "out")
    assert report["verdict"] == "explained" and report["gap"]["shrink"] > 0.95
    named = {effect["name"]: effect["parameters"] for effect in report["effects"]}
    assert named.keys() == truth.keys()
    for name, values in truth.items():
        for key, value in values.items():
            assert named[name][key]["value"] == pytest.approx(value, rel=0.02)
    assert "torque saturation" in (tmp_path / "out" / "report.html").read_text().lower()
    assert (tmp_path / "out" / "looks.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "out" / "patch" / "mujoco.xml").exists()


@pytest.mark.slow
def test_a_wrong_parameter_is_no_effect_and_may_be_withheld(tmp_path: Path) -> None:
    truth = generated("dynamics", 0, tmp_path).answer.effects
    report = reported(tmp_path)
    assert [effect["name"] for effect in report["effects"]] == list(truth)
    assert report["effects"][0]["source"] == "dynamics"
    withheld = reported(tmp_path, withhold=list(truth), quick=True)
    assert [effect["name"] for effect in withheld["effects"]] != list(truth)


def test_every_parameter_of_the_simulator_may_be_withheld_at_once(tmp_path: Path) -> None:
    generated("null", 0, tmp_path)
    case = open_case(read(tmp_path), DYNAMICS)
    assert not case.refitted and "compliance" not in case.not_excited


def test_what_a_look_at_effects_finds_does_not_depend_on_threads(tmp_path: Path) -> None:
    generated("null", 0, tmp_path)
    one, two = (open_case(read(tmp_path), (), jobs) for jobs in (1, 2))
    names = ["backlash", "latency", "torque_of_position", "torque_of_time"]
    assert one.screen(one.likely, names) == two.screen(two.likely, names)
    assert one.likely.values == two.likely.values


def test_the_next_experiment_is_one_that_the_drive_can_make(tmp_path: Path) -> None:
    generated("null", 0, tmp_path)
    case = open_case(read(tmp_path))
    asked = case.experiment([], sorted({*case.not_excited, "torque_saturation"})).sentence
    assert "deadband" in case.not_excited and "torque_saturation" in asked
    assert not any(word in asked for word in ("target", "gain", "deadband", "velocity_limit", "acceleration_limit"))


@pytest.mark.slow
def test_the_number_of_jobs_changes_nothing(tmp_path: Path) -> None:
    generated("pair", 3, tmp_path / "log")
    assert from_the_command_line(tmp_path / "log", tmp_path / "out") == reported(tmp_path / "log")  # in one process


def test_nothing_is_found_where_nothing_is_and_a_harder_recording_is_asked_for(tmp_path: Path) -> None:
    generated("null", 0, tmp_path)
    diagnosis = diagnose(read(tmp_path), DiagnoseConfig())
    asked, track = diagnosis.experiment, diagnosis.case.track
    assert diagnosis.verdict == "no_gap" and not diagnosis.effects
    assert asked.sentence.startswith("Small effects may hide")
    assert 0 < np.abs(asked.commands["current"]).max() <= np.abs(track.command).max()


@pytest.mark.slow
@pytest.mark.parametrize(("index", "unknown"), [(5, "periodic_disturbance"), (14, "slow_drive")])
def test_what_no_effect_is_stays_without_a_name(index: int, unknown: str, tmp_path: Path) -> None:
    assert generated("unknown", index, tmp_path).answer.unknown == unknown
    report = reported(tmp_path)
    assert report["verdict"] == "unexplained" and report["effects"] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "index", "seed", "unknown", "named"),
    [
        ("known_unknown", 15, 9192, "loose_contact", ["torque_speed_limit"]),
        ("unknown", 7, 9193, "load_switch", []),  # a drift of the damping does some of its work
    ],
)
def test_beside_an_unknown_that_functions_do_in_part_what_is_there_is_named_and_nothing_else(
    case: str, index: int, seed: int, unknown: str, named: list[str], tmp_path: Path
) -> None:
    machine = joint.machine(case, index, "tuning", stream("joint", "tuning", seed, case, index)[1])
    assert machine.answer.unknown == unknown and list(machine.answer.effects) == named
    machine.write(tmp_path)
    report = reported(tmp_path)
    assert [effect["name"] for effect in report["effects"]] == named
    for effect in report["effects"]:
        values = {key: found["value"] for key, found in effect["parameters"].items()}
        assert values == pytest.approx(machine.answer.effects[effect["name"]], rel=0.02)


@pytest.mark.slow
def test_an_effect_that_another_motion_may_show_none_of_is_left_out_beside_something_unknown(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    warms_up = {"friction_that_warms_up": UNKNOWN["tuning"]["friction_that_warms_up"]}
    monkeypatch.setitem(UNKNOWN, "tuning", warms_up)  # others may join it
    assert generated("known_unknown", 192, tmp_path, 9177).answer.effects.keys() == {"latency"}
    report = reported(tmp_path)
    assert {effect["name"] for effect in report["effects"]} == {"latency"}
    assert "thermal_drift" not in {each["name"] for each in report["refitted"]}


@pytest.mark.parametrize(
    ("name", "values", "axis"),
    [
        ("cogging", {"amplitude": 0.03, "teeth": 20.0}, "position"),
        ("backlash", {"width": 0.02}, "acceleration"),
        ("thermal_drift", {"rate": 0.2}, "time"),
        ("stribeck_friction", {"static": 0.06, "velocity": 0.3}, "velocity"),
    ],
)
def test_an_effect_shows_along_the_axis_of_its_definition(name: str, values: dict[str, float], axis: str) -> None:
    """Whatever else the whole gap goes with: what cogging moves adds up where the joint is slow."""
    case = open_case(a_log({name: values}, steps(5, 600), (1e-4, 2e-3)))
    moved = case.moved(Hypothesis({name: values}), name)
    assert moved and where(moved, 0)[0]["axis"] == axis
    assert case.moved(Hypothesis({"latency": {"delay": 0.02}}), "latency") is None


@pytest.mark.slow
def test_a_drift_far_smaller_than_where_its_fit_may_start_is_found() -> None:
    log = a_log({"thermal_drift": {"rate": 0.016}}, steps(4, 800), (1e-6, 1e-5))
    report = diagnose(log, DiagnoseConfig())
    assert [effect.name for effect in report.effects] == ["thermal_drift"]


def test_a_limit_that_few_samples_of_one_episode_reach_has_its_name() -> None:
    command = steps(5, 160)
    command[1:] *= 0.6
    limit = 0.9 * command.max() * NOMINAL["torque_constant"]
    log = a_log({"torque_saturation": {"limit": limit}, "load_dependent_friction": {"coefficient": 0.1}}, command)
    report = diagnose(log, DiagnoseConfig())
    assert {effect.name for effect in report.effects} == {"torque_saturation", "load_dependent_friction"}


TRUTH = {"static": 0.06, "velocity": 0.4}


def rubbing_under_drag() -> JointRecording:
    """A drag does all of a Stribeck friction's work over velocity; without it it has to be larger and bent."""
    speeds = np.linspace(-10.0, 10.0, 61)
    drag = Tables(velocity=(-10.0, 10.0, len(speeds))), -0.004 * speeds * np.abs(speeds)
    return a_log({"stribeck_friction": TRUTH}, steps(5, 200), unknown=drag)


@pytest.mark.slow
def test_an_effect_beside_something_unknown_has_no_name_where_nobody_knows_its_size(monkeypatch) -> None:
    vague = (1e-7, 1e7)
    monkeypatch.setattr(
        JointCase, "intervals", lambda self, of: {name: dict.fromkeys(each, vague) for name, each in of.values.items()}
    )
    report = diagnose(rubbing_under_drag(), DiagnoseConfig())
    assert report.verdict == "unexplained" and not report.effects


@pytest.mark.slow
def test_an_effect_that_is_a_function_of_what_an_unknown_is_of_has_its_name_and_its_size() -> None:
    truth, report = TRUTH, diagnose(rubbing_under_drag(), DiagnoseConfig())
    (effect,) = report.effects
    assert report.verdict == "partly_explained" and effect.name == "stribeck_friction"
    assert {key: found.value for key, found in effect.parameters.items()} == pytest.approx(truth, rel=0.05)
    assert report.unexplained.resembles == ("a torque that depends on velocity",)
    elsewhere = report.case.intervals_elsewhere(report.settled.source("stribeck_friction")[1])["stribeck_friction"]
    assert {key: found.ci for key, found in effect.parameters.items()} == elsewhere


def test_intervals_beside_something_unknown_hold_what_another_motion_says() -> None:
    """A quadratic drag: of a slow motion its damping is small, of a fast one large, and each is sure of its own."""
    speeds = np.linspace(-20.0, 20.0, 81)
    drag = Tables(velocity=(-20.0, 20.0, len(speeds))), -0.01 * speeds * np.abs(speeds)
    found = []
    for share in (0.4, 1.0):
        case = open_case(a_log({}, share * steps(5, 300), unknown=drag))
        fit = case.fit(case.refitted, range(case.segments), None)
        found.append([each(fit)["viscous_damping"]["value"] for each in (case.intervals, case.intervals_elsewhere)])
    (slow, wider), (fast, widest) = found
    assert slow[1] < fast[0] and wider[0] < slow[0] and widest[0] < wider[1]

    whole = open_case(a_log({}, steps(5, 300)))
    fit = whole.fit(whole.refitted, range(whole.segments), None)
    for name, each in whole.intervals_elsewhere(fit).items():
        (low, high), (least, most) = whole.intervals(fit)[name]["value"], each["value"]
        assert least <= low < high <= most and most - least < 2.5 * (high - low)  # chance alone makes no regimes


@pytest.mark.slow
def test_an_effect_hidden_by_an_unknown_disturbance_has_its_name_and_size_and_stays_out_of_the_patch(
    tmp_path: Path,
) -> None:
    """Without the disturbance no free run is better for it, so that the simulator does without."""
    time = np.linspace(0.0, 3.0, 61)
    disturbance = Tables(time=(0.0, 3.0, len(time))), 0.1 * np.sin(2 * np.pi * 0.6 * time)
    log = a_log({"cogging": {"amplitude": 0.05, "teeth": 7.0}}, steps(5, 300), (3e-4, 8e-3), unknown=disturbance)
    report = diagnose(log, DiagnoseConfig())
    (effect,) = report.effects
    assert report.verdict == "partly_explained" and effect.name == "cogging" and not effect.patched
    assert effect.parameters["amplitude"].value == pytest.approx(0.05, rel=0.03)
    assert effect.ci[0] > 0.01 and report.gap.after <= report.gap.before
    assert any("time since the start" in each for each in report.unexplained.resembles)
    report.save(tmp_path / "report")
    assert not (tmp_path / "report" / "patch").exists()
    assert "cogging" not in diagnosed(json.loads((tmp_path / "report" / "report.json").read_text()))
    assert "not in the patch" in (tmp_path / "report" / "report.html").read_text()


@pytest.mark.slow
def test_a_drive_that_fades_is_called_so_and_passes_for_no_effect() -> None:
    command = steps(5, 300)
    fading = 1 - 0.4 * (1 - np.exp(-0.01 * np.arange(300) / 1.0))
    log = replace(a_log({}, command * fading), command=command)
    report = diagnose(log, DiagnoseConfig())
    assert report.verdict == "unexplained" and not report.effects
    assert any("changes with the time" in each for each in report.unexplained.resembles)
