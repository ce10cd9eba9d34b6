"""Logs of position servos, uneven rows, and columns that are not what they are called."""

import dataclasses

import numpy as np
import pytest
from recordings import NOMINAL, a_joint

from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording, read, split, write

LAW = {"proportional_gain": 11.6, "derivative_gain": 0.1, "command_limit": 7.4}


def a_servo(lag=0.0, resolution=0.0015, rate=50.0):
    """Three episodes of a servo that follows sines and jumps; its speed register is `lag` late."""
    rng = np.random.default_rng(0)
    t = np.arange(500) / rate + rng.uniform(0, 0.2 / rate, (3, 500))
    t = np.delete(t - t[:, :1], np.s_[200:206], axis=1)
    target = np.array([[0.6], [0.9], [0.4]]) * np.sin(np.array([[2.0], [5.0], [9.0]]) * t) + 0.4 * np.sign(
        np.sin(3 * t)
    )
    supply = 1 - 0.1 * rng.random(t.shape)
    nominal = NOMINAL | {"torque_constant": 1.0, "gravity_torque": 0.3, "position_offset": 0.1} | LAW
    machine = pack(NominalJoint(**nominal), {})[None]
    fine = np.concatenate([t, t - lag], axis=1)
    states = simulate(machine, target, np.zeros((3, 2)), 1 / rate, times=t, scale=supply)[0]
    late = [np.interp(fine[k, t.shape[1] :], t[k], states[k, :, 1]) for k in range(3)]
    position = resolution * np.round(states[..., 0] / resolution)
    velocity = np.array(late) + 0.02 * rng.standard_normal(t.shape)
    lengths, external = np.full(3, t.shape[1]), 0.2 * np.sin(t)
    return JointRecording(
        nominal, 1 / rate, "rotary", target, position, velocity, lengths, (0, 1, 2), t, supply, external
    )


def test_a_servo_comes_back_as_it_was_written(tmp_path):
    one = a_servo()
    again = read(write(one, tmp_path / "out"))
    assert again.servo and again.nominal == one.nominal and not again.left_out
    assert again.sample_time == pytest.approx(0.02, rel=0.05)
    for name in ("command", "position", "velocity", "times", "supply", "external"):
        np.testing.assert_allclose(getattr(again, name), getattr(one, name), rtol=1e-8, atol=1e-8)
    some = split(again, [2, 0])
    np.testing.assert_allclose(some.times[1], one.times[0], atol=1e-8)
    assert some.supply.shape == some.external.shape == (2, one.position.shape[1])


def test_a_drive_that_is_off_has_no_supply(tmp_path):
    folder = write(a_servo(), tmp_path / "out")
    rows = (folder / "joint.csv").read_text().splitlines()
    (folder / "joint.csv").write_text(
        "\n".join([rows[0] + ",enabled", *(f"{row},{k % 2}" for k, row in enumerate(rows[1:]))])
    )
    again = read(folder)
    assert (again.supply[0, ::2] == 0).all() and (again.supply[0, 1::2] > 0.8).all()


@pytest.mark.parametrize("rate", [25.0, 50.0, 200.0])
def test_a_speed_register_that_lags_is_left_out_and_said_to(tmp_path, rate):
    late = read(write(a_servo(lag=0.019, rate=rate), tmp_path / "late"))
    assert late.velocity is None and float(late.left_out["velocity"].split()[5]) == pytest.approx(19, abs=3)
    prompt = read(write(a_servo(rate=rate), tmp_path / "prompt"))
    assert prompt.velocity is not None and not prompt.left_out


@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_a_speed_register_lags_however_slow_the_motion_and_fast_the_log(tmp_path, rate):
    """Once in eight seconds, through an encoder of 4096 steps and a register of 50 steps a second."""
    t = np.arange(round(16 * rate)) / rate
    speed = 2 * np.pi / 8
    step = 2 * np.pi / 4096

    def slow(lag):
        position = step * np.round(0.8 * np.sin(speed * t) / step)
        shown = 0.8 * speed * np.cos(speed * (t - lag)) + 0.01 * np.random.default_rng(0).standard_normal(len(t))
        shown = 50 * step * np.round(shown / (50 * step))
        lengths = np.array([len(t)])
        nominal = NOMINAL | {"torque_constant": 1.0} | LAW
        return JointRecording(nominal, 1 / rate, "rotary", position[None], position[None], shown[None], lengths, (0,))

    late, prompt = (read(write(slow(lag), tmp_path / f"{lag}")) for lag in (0.019, 0.0))
    assert late.velocity is None and float(late.left_out["velocity"].split()[5]) == pytest.approx(19, abs=3)
    assert prompt.velocity is not None and not prompt.left_out


def test_a_filtered_speed_is_left_out_even_where_rows_are_even(tmp_path):
    one = a_joint()
    smooth = one.velocity.copy()
    for k in range(1, smooth.shape[1]):
        smooth[:, k] = smooth[:, k - 1] + 0.3 * (one.velocity[:, k] - smooth[:, k - 1])
    found = read(write(dataclasses.replace(one, velocity=smooth), tmp_path / "filtered"))
    assert found.velocity is None and "lags the positions by" in found.left_out["velocity"]


def a_swing(torque):
    """A joint that swings to and fro under this torque [T], from its positions."""
    states = simulate(
        pack(NominalJoint(**NOMINAL | {"torque_constant": 1.0}), {})[None], torque[None], np.zeros((1, 2)), 0.01
    )
    parts = {
        "command": torque[None],
        "position": states[0, ..., 0],
        "velocity": None,
        "lengths": np.array([len(torque)]),
    }
    return dataclasses.replace(a_joint(), **parts, nominal=NOMINAL | {"torque_constant": 1.0}, episodes=(0,))


def test_currents_without_a_sign_and_goals_are_no_torques(tmp_path):
    torque = 0.4 * np.sin(np.arange(800) * 0.05) + 0.1 * np.sin(np.arange(800) * 0.13)
    one = a_swing(torque)
    read(write(one, tmp_path / "right"))
    unsigned = dataclasses.replace(one, command=np.abs(one.command))
    with pytest.raises(UserError, match=r"current never changes its sign while the joint reverses \d+ times"):
        read(write(unsigned, tmp_path / "unsigned"))
    goal = dataclasses.replace(one, command=np.roll(one.position, -2, axis=1))
    with pytest.raises(UserError, match="current follows the position one to one: is it a goal"):
        read(write(goal, tmp_path / "goal"))


def test_a_torque_against_a_weight_may_keep_its_sign(tmp_path):
    nominal = NOMINAL | {"torque_constant": 1.0, "gravity_torque": 0.5}
    torque = (0.3 + 0.15 * np.sin(np.arange(800) * 0.04))[None]
    states = simulate(pack(NominalJoint(**nominal), {})[None], torque, np.array([[0.6, 0.0]]), 0.01)[0]
    parts = {"command": torque, "position": states[..., 0], "velocity": None, "lengths": np.array([800])}
    read(write(dataclasses.replace(a_joint(), **parts, nominal=nominal, episodes=(0,)), tmp_path / "out"))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("control:\n  proportional: 11.6\n", "control:\n  proportionl: 11.6\n", "unknown key 'proportionl'"),
        ("  proportional: 11.6\n", "", "control: missing proportional"),
        ("proportional: 11.6", "proportional: 0", "proportional is '0', expected a number above 0"),
        (",target,", ",goal,", "unknown column 'goal', did you mean 'target'"),
        (",target,", ",current,", "control is of a position servo, but joint.csv has a current and no target"),
        ("control:\n  proportional: 11.6\n  derivative: 0.1\n  limit: 7.4\n", "", "control is missing"),
        ("sample_time: 0.02", "sample_time: 0.2", r"rows every 0.0[12]\d* s in the median, but sample_time is 0.2 s"),
    ],
)
def test_a_servo_that_cannot_be_read_is_named(tmp_path, old, new, message):
    folder = write(a_servo(), tmp_path / "out")
    for path in folder.iterdir():
        text = path.read_text()
        path.write_text(text.replace(old, new, 1))
    with pytest.raises(UserError, match=message):
        read(folder)


def test_volts_are_no_factor(tmp_path):
    one = a_servo()
    with pytest.raises(UserError, match=r"supply is .*, expected a factor of the command: volts over nominal volts"):
        read(write(dataclasses.replace(one, supply=12 * one.supply), tmp_path / "out"))
