"""Joints that are stepped by a controller are those of a log."""

from dataclasses import replace

import numpy as np
import pytest

from vision_s2r.errors import UserError
from vision_s2r.joint import JOINT_EFFECTS, Joints, NominalJoint, pack, simulate

NOMINAL = NominalJoint(torque_constant=0.5, inertia=0.02, viscous_damping=0.1, coulomb_friction=0.02)
EFFECTS = [effect for effect in JOINT_EFFECTS if not effect.servo]
DT = 0.01


def machines_with_each_effect():
    return np.stack([pack(NOMINAL, {effect.name: effect.moderate()}) for effect in EFFECTS])


def commands(samples):
    return np.repeat(np.random.default_rng(5).uniform(-1.8, 1.8, samples // 20), 20)


def play_back(joints, command):
    shown = [joints.shown]
    for current in command[:-1]:
        shown.append(joints.step(np.full(len(joints), current)))
    return np.stack(shown, axis=1)


def test_stepped_or_simulated_every_effect_is_the_same_to_rounding():
    machines, command = machines_with_each_effect(), commands(400)
    logged = simulate(machines, command[None], np.zeros((1, 2)), DT)[:, 0]
    stepped = play_back(Joints(machines, DT), command)
    counting = [effect.name for effect in EFFECTS].index("encoder_quantization")
    np.testing.assert_allclose(stepped[..., 0], logged[..., 0], atol=1e-12)
    np.testing.assert_allclose(np.delete(stepped, counting, 0), np.delete(logged, counting, 0), atol=1e-11)
    behind = np.diff(stepped[counting, :, 0]) / DT  # a controller cannot look a sample ahead
    np.testing.assert_allclose(stepped[counting, 1:, 1], behind)


def test_a_joint_that_is_reset_remembers_nothing_and_the_others_go_on():
    machines, command = machines_with_each_effect(), commands(200)
    joints = Joints(machines, DT)
    play_back(joints, command)
    before = joints.shown
    joints.reset(np.arange(0, len(joints), 2), machines[::2], np.zeros((len(machines[::2]), 2)))
    np.testing.assert_array_equal(joints.shown[1::2], before[1::2])
    again = play_back(joints, command)[::2]
    np.testing.assert_array_equal(again, play_back(Joints(machines[::2], DT), command))


def test_a_longer_latency_that_joins_later_and_clocks_of_their_own():
    machines = np.stack([pack(NOMINAL, {"latency": {"delay": delay}}) for delay in (0.015, 0.1)])
    command = commands(200)
    joints = Joints(machines[[0, 0]], DT)
    play_back(joints, command[:51])
    joints.reset(np.array([1]), machines[1:], np.zeros((1, 2)), np.array([0.5 * DT]))
    later = play_back(joints, command[50:])
    alone = play_back(Joints(machines[:1], DT), command)
    np.testing.assert_array_equal(later[0], alone[0, 50:])
    np.testing.assert_array_equal(later[1], play_back(Joints(machines[1:], 0.5 * DT), command[50:])[0])


def test_copies_go_their_own_way_and_leave_the_joints_where_they_are():
    machines, command = machines_with_each_effect(), commands(200)
    joints = Joints(machines, DT)
    play_back(joints, command)
    copies = joints.take(np.repeat(np.arange(len(joints)), 2))
    play_back(copies, -command)
    untouched = Joints(machines, DT)
    play_back(untouched, command)
    np.testing.assert_array_equal(play_back(joints.take(np.arange(len(joints))), command), play_back(joints, command))
    np.testing.assert_array_equal(joints.true, (play_back(untouched, command), untouched.true)[1])


@pytest.mark.parametrize(
    "effect", [{}, {"latency": {"delay": 0.015}}, {"compliance": {"stiffness": 5, "damping": 0.1}}]
)
def test_what_a_command_changes_later_is_the_product_of_the_samples_jacobians(effect):
    machine, command = pack(NOMINAL, effect)[None], np.full(40, 0.8)
    joints, nudged = (Joints(machine, DT) for _ in range(2))
    late = joints.delays[0]
    change = np.zeros(4)
    for k in range(40):
        after, jacobian = joints.differentiated(command[k : k + 1])
        acts = np.array([k - late == 20, k - late - 1 == 20], float)  # the command of sample 20
        change = np.concatenate([change, acts]) @ jacobian[0]
        joints.step(command[k : k + 1])
        nudged.step(command[k : k + 1] + 1e-3 * (k == 20))
    np.testing.assert_array_equal(after, joints.moving)
    expected = (nudged.moving - joints.moving)[0] / 1e-3
    assert abs(expected[1]) > 0.01
    np.testing.assert_allclose(change[:2], expected[:2], rtol=1e-3, atol=1e-6)


def test_the_same_bits_however_many_threads(monkeypatch):
    machines, command = np.repeat(machines_with_each_effect(), 3, axis=0), commands(100)
    alone = play_back(Joints(machines, DT), command)
    monkeypatch.setattr("vision_s2r.joint.stepping.WORTH_THREADS", 1)
    np.testing.assert_array_equal(play_back(Joints(machines, DT), command), alone)


def test_what_cannot_be_stepped_is_said_in_one_line():
    machine = pack(NOMINAL, {})[None]
    with pytest.raises(UserError, match=r"command is \(2,\), expected \(1,\)"):
        Joints(machine, DT).step(np.zeros(2))
    with pytest.raises(UserError, match=r"machines are \(2, \d+\)"):
        Joints(machine, DT).reset(np.arange(1), np.repeat(machine, 2, axis=0), np.zeros((1, 2)))
    with pytest.raises(UserError, match="sample_time is 0"):
        Joints(machine, 0.0)
    with pytest.raises(UserError, match="position servos run over whole logs"):
        Joints(pack(replace(NOMINAL, proportional_gain=5.0), {})[None], DT)
