"""Generated arms: another engine's, which the diagnoser's own simulator agrees with where nothing is wrong."""

import numpy as np
import pytest

from vision_s2r.fit.arm.free_run import free_run, gap_errors
from vision_s2r.gapbench.generate import arm
from vision_s2r.recording import read


@pytest.fixture
def short(monkeypatch):
    """Less of an arm's log."""
    monkeypatch.setattr(arm, "SECONDS", 1.5)
    monkeypatch.setattr(arm, "EPISODES", 1)


def drawn(case, index, folder):
    machine = arm.machine(case, index, "tuning", np.random.default_rng(index))
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
    assert list(answer.effects) == ["payload"] and left < 1.5 * arm.NOISE < 5e-3 < gap


def test_the_effects_of_a_pair_are_on_two_joints_and_both_matter(tmp_path, short):
    answer, recording = drawn("pair", 1, tmp_path / "pair")
    joints = {name.partition(".")[0] for name in answer.effects}
    assert len(answer.effects) == len(joints) == 2
    errors = [np.nanmean(gap_errors(recording, free_run(recording, effects))) for effects in ({}, answer.effects)]
    assert errors[1] < 1e-6 and errors[0] > 10 * errors[1]


def test_an_unknown_effect_is_there_and_has_no_name(tmp_path, short):
    for index, (split, known) in enumerate(arm.UNKNOWN.items()):
        machine = arm.machine("unknown", 0, split, np.random.default_rng(3))
        folder = tmp_path / str(index)
        folder.mkdir()
        machine.write(folder)
        recording = read(folder, hold_out=False)
        assert machine.answer.unknown == next(iter(known)) and not machine.answer.effects
        assert np.sqrt(np.nanmean(gap_errors(recording, free_run(recording, {})))) > 5 * arm.NOISE
