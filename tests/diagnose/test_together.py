"""Several recordings of one machine as one: a single report, of what holds in all."""

import dataclasses
import json

import numpy as np
import pytest
from recordings import NOMINAL, QUICK, a_camera, a_joint, an_arm

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose_all
from vision_s2r.diagnose.replay import ReplayConfig, replay_all
from vision_s2r.errors import UserError
from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording, read, split, write
from vision_s2r.recording.joined import joined_arms, read_together

EFFECTS = {"viscous_damping": {"value": 0.2}, "coulomb_friction": {"value": 2 * NOMINAL["coulomb_friction"]}}


def _log(folder, amplitude, hold, seed):
    """Two episodes of a joint that brakes twice as hard as it is believed to, under commands of this size."""
    rng = np.random.default_rng(seed)
    command = np.repeat(amplitude * rng.uniform(-1, 1, (2, 240 // hold)), hold, axis=1)
    states = simulate(pack(NominalJoint(**NOMINAL), EFFECTS)[None], command, np.zeros((2, 2)), 0.01)[0]
    position, velocity = (states[..., k] + 1e-3 * rng.standard_normal(command.shape) for k in (0, 1))
    step = 0.01 * (1 + 1e-6 * seed)  # no two runs' clocks show the same
    one = JointRecording(NOMINAL, step, "rotary", command, position, velocity, np.full(2, 240), (0, 1))
    return str(write(one, folder))


def test_slow_and_fast_motion_together_have_one_simulator(tmp_path):
    logs = [_log(tmp_path / "slow", 0.4, 40, 1), _log(tmp_path / "fast", 3.0, 10, 2)]
    out = tmp_path / "out"
    (page,) = diagnose_all(DiagnoseConfig(recording=logs, together=True, out=str(out), joint=QUICK))
    report = json.loads((page.parent / "report.json").read_text())
    assert page.parent == out and {each["name"] for each in report["effects"]} == set(EFFECTS)
    for each in report["effects"]:
        assert each["parameters"]["value"]["value"] == pytest.approx(EFFECTS[each["name"]]["value"], rel=0.05)
    replayed = tmp_path / "replayed"
    cfg = ReplayConfig(logs, together=True, report=str(out / "report.json"), out=str(replayed))
    (path,) = replay_all(cfg)
    gap = json.loads(path.read_text())["gap"]
    assert path.parent == replayed and {key: gap[key] for key in ("before", "after")} == pytest.approx(
        {key: report["gap"][key] for key in ("before", "after")}, rel=1e-9
    )


def test_a_servo_logged_at_two_gains_is_one_servo(tmp_path):
    """Whose logs at two and a half times the gain are episodes of the same simulator."""
    nominal = NOMINAL | {
        "torque_constant": 1.0,
        "proportional_gain": 12.0,
        "derivative_gain": 0.2,
        "command_limit": 5.0,
    }
    target = np.repeat(np.random.default_rng(3).uniform(-0.6, 0.6, (2, 12)), 20, axis=1)
    folders = []
    for factor in (1.0, 2.5):
        law = nominal | {name: factor * nominal[name] for name in ("proportional_gain", "derivative_gain")}
        machine = pack(NominalJoint(**law), EFFECTS)[None]
        times = np.broadcast_to(np.arange(240) * 0.01, target.shape)
        position = simulate(machine, target, np.zeros((2, 2)), 0.01, times=times)[0, ..., 0]
        one = JointRecording(law, 0.01, "rotary", target, position, None, np.full(2, 240), (0, 1))
        folders.append(write(one, tmp_path / f"gain{factor}"))
    both = read_together(folders)
    assert both.nominal["proportional_gain"] == 12.0 and both.gains.tolist() == [1.0, 1.0, 2.5, 2.5]
    np.testing.assert_allclose(free_run(both, EFFECTS)[..., 0], both.position, atol=1e-8)
    again = read(write(both, tmp_path / "both"))
    np.testing.assert_allclose(again.gains, both.gains)
    assert split(again, [2, 0]).gains.tolist() == [2.5, 1.0]
    rows = (tmp_path / "both" / "joint.csv").read_text().replace(",2.5\n", ",-2.5\n", 1)
    (tmp_path / "both" / "joint.csv").write_text(rows)
    with pytest.raises(
        UserError, match=r"line 482: gain is -2\.5, expected one factor, more than 0, of control's gains"
    ):
        read(tmp_path / "both")
    (tmp_path / "both" / "joint.csv").write_text(rows.replace(",-2.5\n", ",1\n", 1))
    with pytest.raises(UserError, match=r"line 483: gain is 2\.5 after 1 in its episode"):
        read(tmp_path / "both")


def test_an_arms_recordings_are_one(tmp_path):
    one, two = an_arm(seconds=1.5, seed=1), an_arm(seconds=1.0, seed=2)
    folders = [write(each, tmp_path / name) for each, name in ((one, "a"), (two, "b"))]
    both = read_together(folders)
    assert len(both) == len(one) + len(two) and list(both.joints) == list(one.joints)
    np.testing.assert_allclose(both.position[len(one) :, : two.position.shape[1]], two.position, atol=1e-6)
    with pytest.raises(UserError, match="differ in tip"):
        read_together([folders[0], write(dataclasses.replace(two, tip=None), tmp_path / "c")])


def test_recordings_with_even_times_and_with_jittered_ones_are_one():
    even = an_arm(seconds=1.0)
    times = np.tile(even.any.time[0] * 1.0002, (len(even), 1))
    late = dataclasses.replace(
        even, joints={name: dataclasses.replace(j, times=times) for name, j in even.joints.items()}
    )
    np.testing.assert_array_equal(joined_arms([even, late]).any.time, np.concatenate([even.any.time, times]))
    np.testing.assert_array_equal(joined_arms([late, even]).any.time, np.concatenate([times, even.any.time]))


def test_what_is_of_several_machines_is_refused(tmp_path):
    folders = [write(a_joint(), tmp_path / "joint"), write(a_camera(), tmp_path / "camera")]
    with pytest.raises(UserError, match="recordings of kind joint, camera, expected all of one joint, or all of one"):
        read_together(folders)
