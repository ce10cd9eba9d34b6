"""The whole run: that it goes on where it stopped, that policies transfer as they should, and what is refused."""

import json
from functools import partial

import numpy as np
import pytest
from small import ANALYTIC, EFFECTS, QUIET, drive, logged, rng

from vision_s2r.actuator.config import ActuatorConfig, ActuatorTaskConfig, DrivePolicyConfig, check
from vision_s2r.actuator.drive import MotorDrive
from vision_s2r.actuator.models import as_recording, worlds
from vision_s2r.actuator.policy import attempt, learn, rms_error
from vision_s2r.actuator.references import tasks
from vision_s2r.actuator.run import run
from vision_s2r.cli import compose
from vision_s2r.errors import UserError
from vision_s2r.fit.joint.free_run import free_run, measured
from vision_s2r.joint import DYNAMICS

KNOWN = {"all": EFFECTS, "nothing": {}}


def debug(out, *overrides):
    return compose(ActuatorConfig, "actuator", ["actuator=debug", f"out={out}", *overrides])


@pytest.mark.slow
def test_an_interrupted_run_goes_on_as_if_nothing_had_been(tmp_path, monkeypatch, capsys):
    run(debug(tmp_path / "whole"))
    assert "the policies' own motions" in capsys.readouterr().out
    learnt = iter(range(100))
    monkeypatch.setattr(
        "vision_s2r.actuator.run.learn", lambda *given: _interrupt() if next(learnt) == 3 else learn(*given)
    )
    with pytest.raises(KeyboardInterrupt):
        run(debug(tmp_path / "parts"))
    monkeypatch.setattr("vision_s2r.actuator.models.fit", lambda *_: pytest.fail("trained again"))
    run(debug(tmp_path / "parts"))
    assert next(learnt) == 9  # eight policies, one of them begun twice
    whole, parts = (json.loads((tmp_path / name / "actuator.json").read_text()) for name in ("whole", "parts"))
    assert parts["torque"] == whole["torque"] and parts["transfer"] == whole["transfer"]
    assert (tmp_path / "parts/actuator.png").stat().st_size > 10_000
    with pytest.raises(UserError, match="a run with another 'drive' is in this folder"):
        run(debug(tmp_path / "whole", "drive.effects.backlash.width=0.01"))


def _interrupt():
    raise KeyboardInterrupt


def test_a_policy_trained_with_what_a_log_shows_transfers_and_one_trained_with_the_analytic_motor_does_not():
    cfg, task = drive(), ActuatorTaskConfig(seconds=1.0)
    itself = partial(MotorDrive, cfg)
    references = tasks(task, 20, cfg, rng(9))
    worse = {}
    for name, effects in {"analytic": ANALYTIC, "named": EFFECTS}.items():
        world = partial(MotorDrive, cfg, effects=effects)
        policy = learn(world, task, DrivePolicyConfig(history=6, drives=16, episodes=3), cfg, 0)
        own, real = (rms_error(attempt(each, references, policy, 0), cfg.sample_time) for each in (world, itself))
        worse[name] = np.median(real / own)
    assert worse["analytic"] > 2 and worse["named"] < 1.1


@pytest.mark.slow
def test_a_log_is_a_recording_from_which_the_effects_of_the_motor_can_be_told():
    cfg = drive(**QUIET)
    recording = as_recording(cfg, logged(cfg, 3, 0))
    off = {name: np.abs(free_run(recording, each) - measured(recording))[:, :100, 1] for name, each in KNOWN.items()}
    assert off["all"].mean() < 1e-3 and off["nothing"].mean() > 0.1  # rad/s


@pytest.mark.slow
def test_twelve_seconds_of_log_tell_what_the_motor_has(tmp_path):
    worlds(debug(tmp_path, "seeds=1", "logs.minutes=[0.2]", "logs.diagnosed=0.2", "logs.seconds=4"), tmp_path)
    found, constants = (
        json.loads((tmp_path / f"effects-{name}-0.2-0.json").read_text())["effects"]
        for name in ("diagnosed", "identified")
    )
    assert found == {name: pytest.approx(given, rel=0.03) for name, given in EFFECTS.items()}
    assert constants.keys() <= set(DYNAMICS)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("history=[0.0,0.007]", "expected rising multiples of 0.005 s"),
        ("history=[0.01,0.02]", "expected rising multiples of 0.005 s from 0 on"),
        ("drive.sample_time=0.004", r"history is \[0.0, 0.01, 0.02\], expected rising multiples of 0.004 s"),
        ("logs.frequency=[5.0,1.0]", r"logs.frequency = \[5.0, 1.0\]: expected 2 values, rising, above 0"),
        ("+drive.effects.backlsh={width: 0.01}", "no joint effect is called 'backlsh': did you mean 'backlash'"),
        ("drive.effects.backlash.width=-1", "drive.effects.backlash: width is -1"),
        ("+drive.effects.gravity_torque={value: 0.1}", "the load's torque is drawn"),
        ("seeds=0", "seeds = 0: expected above 0"),
        ("logs.seconds=0.2", "too short to learn from"),
    ],
)
def test_what_cannot_be_is_one_clear_line(tmp_path, override, message):
    with pytest.raises(UserError, match=message):
        check(debug(tmp_path, override))
