"""Policies: that they learn, that nothing of a training is lost, and what is said of files that do not fit."""

import random
import shutil
import tempfile
from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from vision_s2r.cli import compose
from vision_s2r.control import (
    AdrRanges,
    DrawnMachines,
    Given,
    OpenLoop,
    Policy,
    SpeedTracking,
    progress,
    track,
    train,
)
from vision_s2r.control.ablate import ablate
from vision_s2r.control.adr import adr, adr_ranges, automatic
from vision_s2r.control.config import (
    FRICTION,
    ControlConfig,
    ControlTaskConfig,
    ControlTrainingConfig,
    ImitationTrainingConfig,
    JointConfig,
)
from vision_s2r.control.effects import CONTROL_EFFECTS
from vision_s2r.control.environment import observation_size
from vision_s2r.control.follow import follow
from vision_s2r.control.policy import RecurrentNetwork
from vision_s2r.control.realities import targets
from vision_s2r.control.teacher import taught
from vision_s2r.control.training_jobs import box_of, drawn
from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint
from vision_s2r.randomize import Box, Posterior

NOMINAL = NominalJoint(**vars(JointConfig()))
BOX = Box.of({"viscous_damping": {"value": [0.08, 0.2]}, "coulomb_friction": {"value": [0.01, 0.06]}}, CONTROL_EFFECTS)
SHORT = ControlTaskConfig(targets=5, hold=0.2)
LITTLE = ControlTrainingConfig(envs=16, steps=4800, rollout=50, batch=400, epochs=2)


def debug(out, *overrides):
    return compose(ControlConfig, "control", ["control=debug", f"out={out}", *overrides])


@pytest.mark.slow
def test_a_policy_learns_to_hold_speeds_on_joints_it_is_not_told_of(tmp_path):
    task, hold = ControlTaskConfig(), ControlTrainingConfig(envs=64, steps=250_000, batch=1000)
    policy = Policy.load(train(task, NOMINAL, DrawnMachines(BOX), 4, hold, tmp_path, 0), task)
    truth = {"viscous_damping": {"value": np.array([0.15, 0.08, 0.2])}, "coulomb_friction": {"value": 0.05}}
    errors = track(policy, task, NOMINAL, Given(truth), np.tile([[5.0, -3.0, 8.0]], (3, 1)))
    assert abs(errors).max() < 0.15  # of the open-loop inverse it is 0.37 and more
    assert (tmp_path / "progress.csv").read_text().startswith("step,reached,median_error\n64000,")


@pytest.mark.slow
def test_a_teacher_that_knows_the_machine_teaches_to_bear_a_latency_in_seconds(tmp_path):
    task, late = ControlTaskConfig(), {"latency": {"delay": [0.0, 0.02]}}
    little = ImitationTrainingConfig(envs=16, steps=320_000, window=25, learning_rate=4e-3, hidden=[32, 32])
    machines = DrawnMachines(Box.of({**FRICTION, **late}, CONTROL_EFFECTS))
    policy = Policy.load(train(task, NOMINAL, machines, 8, little, tmp_path, 0, recurrent=True), task)
    truth = {"viscous_damping": {"value": np.array([0.15, 0.08, 0.2])}, "latency": {"delay": 0.015}}
    errors = track(policy, task, NOMINAL, Given(truth), np.tile([[5.0, -3.0, 8.0, -6.0]], (3, 1)))
    assert abs(errors).mean() < 0.05  # of the proportional controller that it begins with, four times that
    progress = (tmp_path / "progress.csv").read_text()
    assert progress.startswith("step,reached,median_error\n16000,") and "\n320000," in progress


def test_a_policy_remembers_in_numpy_what_it_was_trained_to_in_torch():
    torch.manual_seed(0)
    network = RecurrentNetwork(observation_size(2), [8, 6])
    seen = torch.randn(5, 3, observation_size(2))
    expected, _ = network(seen, torch.zeros(1, 3, 6))
    policy = Policy(network)
    for _ in range(2):  # what an episode taught is gone in the next
        policy.begin(3)
        actions = np.stack([policy.act(each.numpy())[:, 0] for each in seen])
        np.testing.assert_allclose(actions, expected.detach().clamp(-1, 1).numpy(), atol=1e-5)


@pytest.mark.parametrize("kind", ["drawn", "adr_ranges", "imitation", "recurrent"])
def test_an_interrupted_training_goes_on_as_if_nothing_had_been(tmp_path, monkeypatch, kind):
    cfg = debug(tmp_path)
    taught = kind in ("imitation", "recurrent")
    how = replace(cfg.imitation, steps=4800) if taught else LITTLE

    def machines():
        return DrawnMachines(BOX) if kind == "drawn" else adr_ranges(cfg, 0)

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    before = random.getstate(), torch.get_rng_state().tolist()
    whole = train(SHORT, NOMINAL, machines(), 2, how, tmp_path / "whole", 0, kind == "recurrent")
    assert (random.getstate(), torch.get_rng_state().tolist()) == before  # a call leaves no global changed
    assert not [*tmp_path.glob("SB3*")]  # nor a log among temporary files
    left, step = (
        iter([1] * (170 if kind == "drawn" else 700)),
        SpeedTracking.step,
    )  # the ranges' own trials are steps too
    monkeypatch.setattr(SpeedTracking, "step", lambda *given: step(*given) if next(left, 0) else _interrupt())
    with pytest.raises(KeyboardInterrupt):
        train(SHORT, NOMINAL, machines(), 2, how, tmp_path / "parts", 0, kind == "recurrent")
    monkeypatch.undo()
    parts = train(SHORT, NOMINAL, machines(), 2, how, tmp_path / "parts", 0, kind == "recurrent")
    for name, tensor in load_file(whole).items():
        np.testing.assert_array_equal(tensor, load_file(parts)[name], err_msg=name)
    assert (tmp_path / "whole/progress.csv").read_text() == (tmp_path / "parts/progress.csv").read_text()
    assert progress.machines_of(tmp_path / "whole") == progress.machines_of(tmp_path / "parts")


def _interrupt():
    raise KeyboardInterrupt


def test_ranges_widen_while_the_policy_reaches_its_targets_and_shrink_back_when_it_does_not(tmp_path):
    reached = 25.0
    source = AdrRanges(automatic(debug(tmp_path), 0), lambda policy, values, seed: np.full(64, reached), 64, 2, 50)
    for _ in range(20):
        source.updated(None)
    assert len(source.history) == 10
    low, high = source.history[-1]["ranges"]["viscous_damping"]["value"]
    assert low < 0.1 < high and np.isfinite(source.history[-1]["entropy"])
    drawn = source.draw(500, np.random.default_rng(0))["viscous_damping"]["value"]
    assert low <= drawn.min() < drawn.max() <= high
    reached = 5.0
    for _ in range(30):
        source.updated(None)
    assert source.history[-1]["ranges"]["viscous_damping"]["value"] == [0.1, 0.1]
    for _ in range(10):  # beyond the last update that may move them
        source.updated(None)
    assert len(source.history) == 25


def test_a_boundary_is_judged_by_what_can_be_reached_there(tmp_path):
    cfg = debug(tmp_path, "task.hold=0.4", "task.targets=25")
    weak = {"viscous_damping": {"value": np.full(16, 0.4)}, "torque_constant": {"value": np.full(16, 0.3)}}
    reached = abs(taught(cfg.task, NOMINAL, Given(weak), targets(cfg.task, 16, 1), 0.1, 1)) < cfg.task.tolerance
    assert 0.1 < reached.mean() < 0.4  # 4 A of 0.3 N·m/A against 0.4 N·m·s/rad: 3 rad/s at most
    tried, nothing = adr_ranges(cfg, 0).evaluate, OpenLoop(NominalJoint(0.3, 0.02, 0.4, 0.02), cfg.task)
    assert tried(nothing, weak, 1).mean() > 0.9 * cfg.task.targets  # told of this joint, and too weak like any other
    assert tried(OpenLoop(NOMINAL, cfg.task), weak, 1).mean() < 1


def test_a_training_with_other_settings_is_not_taken_for_this_one(tmp_path):
    little = ControlTrainingConfig(**{**vars(LITTLE), "steps": 800})
    train(SHORT, NOMINAL, DrawnMachines(BOX), 2, little, tmp_path, 0)
    assert train(SHORT, NOMINAL, DrawnMachines(BOX), 2, little, tmp_path, 0).exists()
    other = Box.of({"viscous_damping": {"value": [0.05, 0.3]}}, CONTROL_EFFECTS)
    with pytest.raises(UserError, match=r"holds a training with other settings \(machines\), expected another out="):
        train(SHORT, NOMINAL, DrawnMachines(other), 2, little, tmp_path, 0)


def test_a_policy_file_that_does_not_fit_is_said_in_one_line(tmp_path):
    path = train(
        SHORT, NOMINAL, DrawnMachines(BOX), 2, ControlTrainingConfig(**{**vars(LITTLE), "steps": 800}), tmp_path, 0
    )
    with pytest.raises(UserError, match=r"policy.safetensors: made for task.highest=8.0, expected 9"):
        Policy.load(path, ControlTaskConfig(highest=9.0))
    broken = tmp_path / "broken.safetensors"
    shutil.copy(path, broken)
    _tamper(broken, b'\\"history\\": 2', b'\\"history\\": 4')
    with pytest.raises(UserError, match=r"broken.safetensors: .*layers.0.weight' is \(32, 6\).*\(32, 10\)"):
        Policy.load(broken, ControlTaskConfig())


def _tamper(path, old, new):
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))


@pytest.mark.parametrize("experiment", [follow, pytest.param(ablate, marks=pytest.mark.slow), adr])
def test_the_experiments_run_and_end_in_a_picture(tmp_path, experiment):
    picture = experiment(debug(tmp_path))
    assert picture.stat().st_size > 10_000
    assert picture.with_suffix(".json").exists()


@pytest.mark.parametrize(
    ("overrides", "line"),
    [
        (
            ["policies.randomized.effects.viscous_damping.value=[0.2,0.1]"],
            r"value is \[0.2, 0.1\], expected low before",
        ),
        (["+policies.default.effects.backlsh.width=0.1"], "'backlsh'.*backlash"),
        (["training.rollout=70"], "training.rollout = 70: expected to divide an episode's 100 samples"),
        (["policies.default.recurrent=true"], "recurrent and learns by method=ppo, expected imitation"),
        (["only=[memry]"], "only: no policy 'memry'.*memory"),
        (["task.lowest=9"], "task.lowest = 9: expected up to task.highest = 8"),
        (["training.epoch=3"], "unknown configuration key 'training.epoch'.*training.epochs"),
    ],
)
def test_bad_input_is_one_line(tmp_path, overrides, line):
    with pytest.raises(UserError, match=line):
        follow(debug(tmp_path, *overrides))


def test_the_posterior_of_an_identification_is_trained_on(tmp_path):
    values = {"viscous_damping": {"value": 0.15}, "coulomb_friction": {"value": 0.05}}
    Posterior(CONTROL_EFFECTS, values, np.diag([1e-6, 1e-8])).write(tmp_path / "posterior.yaml")
    cfg = debug(tmp_path, f"policies.default.distribution={tmp_path}/posterior.yaml")
    drawn_from = drawn(cfg, cfg.policies["default"]).machines(0).draw(200, np.random.default_rng(0))
    assert np.std(drawn_from["viscous_damping"]["value"]) == pytest.approx(1e-3, rel=0.2)
    assert np.mean(drawn_from["coulomb_friction"]["value"]) == pytest.approx(0.05, rel=0.01)
    with pytest.raises(UserError, match="a policy with effects and with distribution"):
        drawn(cfg, replace(cfg.policies["history"], distribution="x.yaml"))


def test_a_range_without_the_nominal_joint_is_warned_of(tmp_path, caplog):
    box_of(debug(tmp_path), {"viscous_damping": {"value": [0.12, 0.2]}})
    assert "viscous_damping: value from 0.12 to 0.2 leaves out the nominal value, 0.1" in caplog.text
