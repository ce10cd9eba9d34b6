"""Position servos: a perfect one has no gap, and what is added to it is named, at samples that jitter."""

import json

import numpy as np
import pytest

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.diagnose.replay import replay
from vision_s2r.fit.case import Hypothesis
from vision_s2r.joint import Nominal, pack, simulate
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import diagnosed, values

NOMINAL = {
    "torque_constant": 1.0,
    "inertia": 0.02,
    "viscous_damping": 0.25,
    "coulomb_friction": 0.05,
    "gravity_torque": 0.2,
    "bias_torque": 0.0,
    "proportional_gain": 11.6,
    "derivative_gain": 0.0,
    "command_limit": 7.4,
}


def a_servo(rate, effects, jitter=0.2, seconds=4.0, noise=2e-4):
    """Five episodes of sines and jumps, simulated in steps of a quarter of a millisecond."""
    rng = np.random.default_rng(0)
    t = np.arange(round(seconds * rate)) / rate + rng.uniform(0, jitter / rate, (5, round(seconds * rate)))
    t -= t[:, :1]
    target = 0.8 * np.sin(np.array([[2.0], [9.0], [4.0], [1.0], [3.0]]) * t)
    for row, hold in ((1, 0.6), (3, 1.1)):
        levels = rng.uniform(-1, 1, 20)
        levels[0] = 0
        target[row] = levels[(t[row] / hold).astype(int)]
    machine = pack(Nominal(**NOMINAL), effects)[None]
    states = simulate(machine, target, np.zeros((5, 2)), 1 / rate, times=t, substeps=round(4000 / rate))[0]
    position = states[..., 0] + noise * rng.standard_normal(t.shape)
    lengths = np.full(5, t.shape[1])
    return JointRecording(NOMINAL, 1 / rate, "rotary", target, position, None, lengths, tuple(range(5)), t)


def test_a_perfect_servo_has_no_gap():
    report = diagnose(a_servo(25.0, {}), DiagnoseConfig()).to_dict()
    assert report["verdict"] == "no_gap" and not report["effects"]
    assert report["gap"]["metric"] == "position_rmse" and report["gap"]["unit"] == "rad"


def test_what_a_servo_lacks_is_named_and_its_report_replays_to_the_digit(tmp_path):
    recording = a_servo(50.0, {"latency": {"delay": 0.013}})
    diagnosis = diagnose(recording, DiagnoseConfig())
    report = json.loads(json.dumps(diagnosis.to_dict()))
    assert [effect["name"] for effect in report["effects"]] == ["latency"] and report["verdict"] == "explained"
    assert report["effects"][0]["parameters"]["delay"]["value"] == pytest.approx(0.013, rel=0.02)
    states = {line["name"]: line["status"] for line in report["candidates"]}
    assert states["torque_constant"] == "not_excited" and states["deadband"] != "not_excited"
    asked = diagnosis.case.experiment([Hypothesis(), diagnosis.settled.simulator.hypothesis], ["torque_saturation"])
    assert "arget in steps of" in asked and "rad about" in asked and "positions then differ" in asked
    again = replay(recording, values(diagnosed(report)), tmp_path, held_out=report["held_out"])["gap"]
    assert {key: report["gap"][key] for key in again} == again
    rows = np.loadtxt(tmp_path / "replay.csv", delimiter=",", skiprows=1)
    assert np.sqrt(np.mean((rows[:, 4] - rows[:, 2]) ** 2)) == pytest.approx(again["after"], rel=1e-3)
    other = replay(a_servo(50.0, {}), values(diagnosed(report)), tmp_path, held_out=report["held_out"])
    assert "not seen" not in other["described"] and other["gap"]["after"] > other["gap"]["before"]
