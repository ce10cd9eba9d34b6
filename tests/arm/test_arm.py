"""Arms against MuJoCo's own stepping, and joint by joint against themselves."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pybullet_data
import pytest
from recordings import DRIVE, TWO_LINKS, an_arm, joint_row
from scipy.integrate import solve_ivp

from vision_s2r.arm.bodies import Bodies
from vision_s2r.arm.model import ArmModel, opened
from vision_s2r.arm.simulate import simulate
from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.problems import motions, problems
from vision_s2r.fit.joint.effects import inertia
from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.fit.joint.track import make_track
from vision_s2r.joint import NominalJoint, pack
from vision_s2r.joint import simulate as one_joint

T = np.arange(300) * 0.01
COMMAND = np.array([0.5 * np.sin(4 * T) + 0.3 * np.sign(np.sin(3 * T)), 0.6 * np.sin(5 * T + 1)])
FIRST = np.stack([COMMAND[:, 0], np.zeros(2)], axis=1)
NAMES = ("shoulder", "elbow")


def the_bodies(whole=None):
    return Bodies(ArmModel(TWO_LINKS), NAMES, {"turn": 0.3}, "tool", whole)


@pytest.mark.parametrize("spring", ["", 'stiffness="40" springref="0.6"'])
def test_a_free_run_is_that_of_mujoco(tmp_path, spring):
    path = tmp_path / "arm.xml"
    path.write_text(TWO_LINKS.read_text().replace('name="elbow"', f'name="elbow" {spring}'))
    bodies = Bodies(ArmModel(path), NAMES, {"turn": 0.3}, "tool")
    found = simulate(bodies, np.array([joint_row({"coulomb_friction": {"value": 0.0}})] * 2), COMMAND, FIRST, T).states
    spec = ArmModel(path).spec
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for joint in spec.joints:
        joint.frictionloss = 0.0
    spec.joint("turn").armature = 1e6  # held
    model = spec.compile()
    model.opt.timestep = 1e-4
    data = mujoco.MjData(model)
    data.qpos[:] = (*COMMAND[:, 0], 0.3)
    expected = np.empty((2, len(T)))
    for k in range(len(T)):
        expected[:, k] = data.qpos[:2]
        for _ in range(100):
            asked = DRIVE["proportional_gain"] * (COMMAND[:, k] - data.qpos[:2])
            data.qfrc_applied[:2] = np.clip(asked, -15, 15)
            mujoco.mj_step(model, data)
    assert np.abs(found[..., 0] - expected).max() < 1e-3
    assert np.ptp(expected) > 1.0


@pytest.mark.slow
def test_joints_one_by_one_under_the_loads_of_the_others_make_the_same_arm():
    effects = ({"backlash": {"width": 0.02}}, {"latency": {"delay": 0.013}})
    machines = np.array([joint_row(each) for each in effects])
    run = simulate(the_bodies(), machines, COMMAND, FIRST, T)
    inertia = the_bodies().loads(*run.states.T, np.zeros((len(T), 2)))[1]
    parts = len(run.load) // len(T)
    assert parts == 5  # where a command steps, a load changes within a row
    for j, apart in enumerate((1e-3, 1e-6)):  # impacts of play tell even the inertias apart
        own = np.interp(np.arange(len(T) * parts) + 0.5, np.arange(len(T)) * parts, inertia[:, j])
        loads = {"external": run.load[None, :, j], "load_inertia": own[None]}
        alone = one_joint(machines[j : j + 1], COMMAND[j : j + 1], FIRST[j : j + 1], 0.01, **loads)[0, 0]
        assert np.sqrt(np.mean((alone[:, 0] - run.states[j, :, 0]) ** 2)) < apart


def test_a_simulator_that_runs_away_is_infinitely_wrong():
    runs = FreeRuns(an_arm())
    assert np.isfinite(runs.error("elbow", {}))
    springs = {}
    for joint in NAMES:
        springs[f"{joint}.compliance"] = {"stiffness": 113.0, "damping": 2.0}
        springs[f"{joint}.inertia"] = {"value": 1e-9}
        springs[f"{joint}.viscous_damping"] = {"value": 0.0}
        springs[f"{joint}.derivative_gain"] = {"value": 2.3}
    assert runs.error("elbow", springs) == np.inf


def test_an_encoder_shows_its_own_steps():
    fine, coarse = (joint_row({"encoder_quantization": {"resolution": 0.05, "offset": each}}) for each in (0.0, 0.02))
    shown = simulate(the_bodies(), np.array([fine, coarse]), COMMAND, FIRST, T).states[:, 1:, 0]
    np.testing.assert_allclose(np.mod(shown - [[0.0], [0.02]] + 0.01, 0.05), 0.01, atol=1e-9)


def test_a_payload_weighs_on_every_joint_before_it():
    mass, empty = the_bodies().terms(np.zeros(2), np.zeros(2))
    heavy, bias = the_bodies({"payload": {"mass": 0.2, "x": 0.05, "y": 0.0, "z": 0.0}}).terms(np.zeros(2), np.zeros(2))
    reach = np.array([0.25 + 0.2 + 0.05, 0.2 + 0.05])  # the wrist is turned about its own axis only
    np.testing.assert_allclose(bias - empty, -0.2 * 9.81 * reach, rtol=1e-6)
    np.testing.assert_allclose(heavy - mass, 0.2 * np.outer(reach, reach), rtol=1e-5)


def test_an_arm_on_a_tilted_base_weighs_what_it_does_when_turned():
    tilted, level = the_bodies({"base_tilt": {"roll": 0.0, "pitch": 0.1}}), the_bodies()
    pose, turned, still = np.array([0.2, 0.7]), np.array([0.3, 0.7]), np.zeros(2)
    np.testing.assert_allclose(tilted.terms(pose, still)[1], level.terms(turned, still)[1], rtol=1e-9)
    weight = the_bodies({"base_tilt": {"roll": 0.2, "pitch": 0.0}}).terms(pose, still)[1]
    np.testing.assert_allclose(weight, np.cos(0.2) * level.terms(pose, still)[1], rtol=1e-9)


def test_an_arm_whose_encoder_is_off_weighs_what_it_does_where_it_is():
    pose, moved, still = np.array([0.2, 0.7]), np.array([0.2, 0.6]), np.zeros(2)
    off, right = the_bodies({"elbow.position_offset": {"value": 0.1}}), the_bodies()
    for one, other in zip(off.terms(pose, still), right.terms(moved, still), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    np.testing.assert_allclose(off.tip(pose[None]), right.tip(moved[None]), rtol=1e-9)


def test_an_inertia_that_changes_is_integrated():
    nominal = NominalJoint(**DRIVE | {"coulomb_friction": 0.0, "command_limit": 100.0})
    load = 0.05 + 0.04 * np.sin(7 * T)
    found = one_joint(pack(nominal, {})[None], COMMAND[:1], FIRST[:1], 0.01, load_inertia=load[None])[0, 0]
    state, expected = FIRST[0], [FIRST[0]]
    for k in range(len(T) - 1):

        def motion(_, s, k=k):
            return [s[1], (60 * (COMMAND[0, k] - s[0]) - s[1]) / (0.05 + load[k])]

        state = solve_ivp(motion, (0, 0.01), state, rtol=1e-9, atol=1e-12).y[:, -1]
        expected.append(state)
    np.testing.assert_allclose(found, expected, atol=4e-3)


def test_noise_of_the_measured_motion_loads_no_joint():
    recording = an_arm(noise=2e-4)
    made = problems(recording, motions(FreeRuns(recording), {}), {})
    for name, joint in made.joints.items():
        rest = joint.position - free_run(joint, {})[..., 0]
        assert np.sqrt(np.mean(rest**2)) < 1.1 * 2e-4, name
        assert inertia.ranges(make_track(joint, False), 2e-4)[0].low == np.log(
            joint.least_inertia
        )  # a rotor's is not negative


def test_mujoco_leaves_no_log_where_one_works(tmp_path, monkeypatch, caplog):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.xml").write_text(TWO_LINKS.read_text().replace("<worldbody>", '<worldbody><site pos="NaN 0 0"/>'))
    ArmModel(tmp_path / "arm.xml")
    assert "contains a 'NaN'" in caplog.text and [path.name for path in tmp_path.iterdir()] == ["arm.xml"]


def test_a_vendors_tensor_of_no_body_is_balanced_and_said_once(caplog):
    path = Path(pybullet_data.getDataPath()) / "xarm" / "xarm6_robot.urdf"
    model = opened(path)
    assert opened(path) is model and list(model.joints)[:6] == [f"joint{k}" for k in range(1, 7)]
    inertia = model.spec.copy().compile().body("link2").inertia
    assert 2 * inertia.max() <= inertia.sum() and caplog.text.count("balances it") == 1


def test_episodes_that_begin_in_other_postures_are_run_in_as_many_steps():
    """A folded arm is lighter, and its servos swing faster: loads on joints were of another length, an error."""
    recording, folded = an_arm(), np.array([[0.0, 0.0], [0.0, 2.6]])
    stiff = {
        name: replace(
            joint,
            nominal=joint.nominal | {"proportional_gain": (2e4, 60.0)[j], "inertia": 0.001},
            position=joint.position - joint.position[:, :1] + folded[:, j : j + 1],
            command=joint.command - joint.command[:, :1] + folded[:, j : j + 1],
        )
        for j, (name, joint) in enumerate(recording.joints.items())
    }
    runs = FreeRuns(replace(recording, joints=stiff))
    alike = {len(each.load) / len(each.position) for each in motions(runs, {})}
    assert len(alike) == 1
