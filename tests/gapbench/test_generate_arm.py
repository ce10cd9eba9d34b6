"""Generated arms: another engine's, which the diagnoser's own simulator agrees with where nothing is wrong."""

import mujoco
import numpy as np
import pytest
from recordings import played

from vision_s2r.fit.arm.free_run import free_run, gap_errors
from vision_s2r.gapbench.generate import arm, arm_bodies
from vision_s2r.patch.arm import mjcf
from vision_s2r.recording import read


@pytest.fixture
def short(monkeypatch):
    """Less of an arm's log."""
    monkeypatch.setattr(arm, "SECONDS", 1.5)
    monkeypatch.setattr(arm, "EPISODES", 1)


def drawn(case, index, folder, **asked):
    machine = arm.machine(case, index, "tuning", np.random.default_rng(index), **{"arms": "chains"} | asked)
    folder.mkdir()
    machine.write(folder)
    return machine.answer, read(folder, hold_out=False)


def test_a_right_arm_is_simulated_alike_and_a_wrong_one_is_not(tmp_path, short, monkeypatch):
    with monkeypatch.context() as quiet:
        quiet.setattr(arm, "NOISE", 0.0)
        _, right = drawn("null", 0, tmp_path / "null")
    assert np.sqrt(np.nanmean(gap_errors(right, free_run(right, {})))) < 0.2 * arm.NOISE
    answer, wrong = drawn("single", arm.FIRST.index("payload"), tmp_path / "payload")
    gap, left = (np.sqrt(np.nanmean(gap_errors(wrong, free_run(wrong, effects)))) for effects in ({}, answer.effects))
    assert list(answer.effects) == ["payload"] and left < 1.5 * arm.NOISE < 2e-3 < gap
    answer, off = drawn("single", arm.FIRST.index("position_offset"), tmp_path / "position_offset")
    gap, left = (np.sqrt(np.nanmean(gap_errors(off, free_run(off, effects)))) for effects in ({}, answer.effects))
    assert len(answer.effects) == 1 and left < 1.5 * arm.NOISE < 1e-3 < gap


@pytest.mark.parametrize("name", arm_bodies.SHIPPED)
def test_a_public_arm_is_simulated_alike(tmp_path, monkeypatch, name):
    """Of PyBullet and of MuJoCo: masses, tensors that no body can have, joints that are held, where home is."""
    monkeypatch.setattr(arm_bodies, "SHIPPED", [name])
    monkeypatch.setattr(arm, "SECONDS", 1.0)
    monkeypatch.setattr(arm, "EPISODES", 1)
    answer, recording = drawn("single", arm.FIRST.index("payload"), tmp_path / "arm", arms="public")
    assert answer.notes["arm"] == name and answer.notes["joints"] == len(recording.joints)
    gap, left = (
        np.sqrt(np.nanmean(gap_errors(recording, free_run(recording, each)), axis=1)) for each in ({}, answer.effects)
    )
    assert gap.max() > 3 * left.max() and left.max() < 1.2 * arm.NOISE


def test_the_patch_of_a_public_arm_moves_as_it_did(tmp_path, monkeypatch):
    """Its URDF says less of its motors than the recording does: an effort is a limit of the joint's in MuJoCo."""
    monkeypatch.setattr(arm_bodies, "SHIPPED", ["xarm6"])
    monkeypatch.setattr(arm, "SECONDS", 1.0)
    _, recording = drawn("null", 0, tmp_path / "arm", arms="public")
    model = mujoco.MjModel.from_xml_string(mjcf({}, recording))
    assert np.abs(played(model, recording) - recording.position[0]).max() < 0.01 < np.ptp(recording.position[0])


@pytest.mark.parametrize("rate", [30.0, 500.0])
def test_logs_have_the_rate_that_is_asked_for(tmp_path, short, rate):
    answer, recording = drawn("single", arm.FIRST.index("latency"), tmp_path / "log", rate=rate)
    times = recording.any.time[0, : recording.any.lengths[0]]
    assert recording.any.sample_time == pytest.approx(1 / rate) and np.diff(times) == pytest.approx(1 / rate)
    assert np.sqrt(np.nanmean(gap_errors(recording, free_run(recording, answer.effects)))) < 1.1 * arm.NOISE


def test_the_effects_of_a_pair_are_on_two_joints_and_both_matter(tmp_path, short):
    answer, recording = drawn("pair", 1, tmp_path / "pair")
    joints = {name.partition(".")[0] for name in answer.effects}
    assert len(answer.effects) == len(joints) == 2
    errors = [np.nanmean(gap_errors(recording, free_run(recording, effects))) for effects in ({}, answer.effects)]
    assert errors[1] < 1e-6 and errors[0] > 10 * errors[1]


def test_an_unknown_effect_is_there_and_has_no_name(tmp_path, short):
    for index, (split, known) in enumerate(arm.UNKNOWN.items()):
        machine = arm.machine("unknown", 0, split, np.random.default_rng(3), arms="chains")
        folder = tmp_path / str(index)
        folder.mkdir()
        machine.write(folder)
        recording = read(folder, hold_out=False)
        assert machine.answer.unknown == next(iter(known)) and not machine.answer.effects
        assert np.sqrt(np.nanmean(gap_errors(recording, free_run(recording, {})))) > 5 * arm.NOISE
