"""The whole run: that it goes on where it stopped, that controllers transfer as they should, and what is refused."""

import json
from functools import partial

import numpy as np
import pytest
from small import drive, logged, rng

from vision_s2r.actuator.config import ActuatorConfig, ActuatorTaskConfig, ActuatorTrainingConfig, check
from vision_s2r.actuator.control import attempt, rms_error, tune
from vision_s2r.actuator.drive import MotorDrive, NetworkDrive
from vision_s2r.actuator.references import tasks
from vision_s2r.actuator.run import run
from vision_s2r.actuator.training import fit
from vision_s2r.cli import compose
from vision_s2r.errors import UserError


def debug(out, *overrides):
    return compose(ActuatorConfig, "actuator", ["actuator=debug", f"out={out}", *overrides])


def test_an_interrupted_run_goes_on_as_if_nothing_had_been(tmp_path, monkeypatch, capsys):
    run(debug(tmp_path / "whole"))
    assert "the policies' own motions" in capsys.readouterr().out
    tunings = iter(range(100))
    monkeypatch.setattr(
        "vision_s2r.actuator.run.tune", lambda *given: _interrupt() if next(tunings) == 3 else tune(*given)
    )
    with pytest.raises(KeyboardInterrupt):
        run(debug(tmp_path / "parts"))
    monkeypatch.setattr("vision_s2r.actuator.run.fit", lambda *_: pytest.fail("trained again"))
    run(debug(tmp_path / "parts"))
    assert next(tunings) == 9  # eight controllers, one of them begun twice
    whole, parts = (json.loads((tmp_path / name / "actuator.json").read_text()) for name in ("whole", "parts"))
    assert parts["torque"] == whole["torque"] and parts["transfer"] == whole["transfer"]
    assert (tmp_path / "parts/actuator.png").stat().st_size > 10_000
    with pytest.raises(UserError, match="a run with another 'drive' is in this folder"):
        run(debug(tmp_path / "whole", "drive.effects.backlash.width=0.01"))


def _interrupt():
    raise KeyboardInterrupt


def test_a_controller_tuned_with_the_network_transfers_and_one_tuned_with_the_analytic_motor_does_not():
    cfg, task = drive(), ActuatorTaskConfig(tuned_on=4, generations=12, seconds=1.2)
    network = fit(logged(cfg, 120, 0), (0.0, 0.005, 0.01, 0.015, 0.02), 0.005, ActuatorTrainingConfig(steps=500), 0)
    itself = partial(MotorDrive, cfg)
    references = tasks(task, 20, cfg.sample_time, rng(9))
    worse = {}
    for name, world in {
        "analytic": partial(MotorDrive, cfg, analytic=True),
        "network": partial(NetworkDrive, cfg, network=network),
    }.items():
        gains = tune(world, task, cfg.sample_time, 0)
        own, real = (rms_error(attempt(each, references, gains, 0), cfg.sample_time) for each in (world, itself))
        worse[name] = np.median(real / own)
    assert worse["analytic"] > 2 and worse["network"] < 1.5


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
