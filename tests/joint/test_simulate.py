"""The simulator as a whole: steps, threads, observers, bad input, and recordings made elsewhere."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pybullet
import pytest
import yaml
from recordings import EMPS, EXAMPLES, needs_emps

from vision_s2r.errors import UserError
from vision_s2r.joint import COLUMNS, DYNAMICS, JOINT_EFFECTS, NominalJoint, Tables, benchmark, pack, simulate

NOMINAL = NominalJoint(0.5, inertia=0.02, viscous_damping=0.1, coulomb_friction=0.02, gravity_torque=0.05)
EFFECTS = [effect for effect in JOINT_EFFECTS if not effect.servo]
DT = 0.01


def commands(episodes=3, samples=300):
    rng = np.random.default_rng(5)
    return np.repeat(rng.uniform(-1.8, 1.8, (episodes, samples // 20)), 20, axis=1)


def machines_with_each_effect():
    return np.stack([pack(NOMINAL, {effect.name: effect.moderate()}) for effect in EFFECTS])


def rms(values):
    return np.sqrt(np.mean(np.square(values), axis=(1, 2)))


def test_every_effect_shows_and_halving_the_step_changes_nothing_that_an_encoder_sees():
    command = commands()
    first = np.zeros((len(command), 2))
    machines = machines_with_each_effect()
    nominal = simulate(pack(NOMINAL, {})[None], command, first, DT)
    states = simulate(machines, command, first, DT)
    halved = simulate(machines, command, first, DT, substeps=10)
    for effect, shown, change in zip(EFFECTS, rms(states - nominal), rms(states - halved), strict=True):
        assert shown[1] > 0.01, effect.name
        assert change[0] < 5e-5 and change[1] < 2e-4, effect.name


def test_the_error_falls_with_the_square_of_the_step():
    command = commands()
    first = np.zeros((len(command), 2))
    effects = ("gravity_torque", "cogging", "stribeck_friction", "torque_speed_limit", "thermal_drift")
    both = {name: JOINT_EFFECTS[name].moderate() for name in (*effects, "asymmetric_friction")}
    spring = both | {"compliance": {"stiffness": 5.0, "damping": 0.01}}
    machines = np.stack([pack(NOMINAL, both), pack(NOMINAL, spring)])
    exact = simulate(machines, command, first, DT, substeps=320)
    coarse, fine = (rms(simulate(machines, command, first, DT, substeps=n) - exact)[:, 1] for n in (5, 20))
    assert np.all(fine < coarse / 8)  # 16 of a second order, 4 of a first


def test_a_neutral_effect_is_no_effect():
    command = commands(1)
    for effect in EFFECTS:
        values = {p.name: p.moderate if p.neutral is None else p.neutral for p in effect.parameters}
        if effect.is_neutral(values):
            neutral = simulate(pack(NOMINAL, {effect.name: values})[None], command, np.zeros((1, 2)), DT)
            np.testing.assert_array_equal(neutral, simulate(pack(NOMINAL, {})[None], command, np.zeros((1, 2)), DT))


def test_the_same_bits_whatever_the_number_of_threads():
    command = commands()
    first = np.zeros((len(command), 2))
    machines = machines_with_each_effect()
    alone = simulate(machines, command, first, DT, threads=1)
    np.testing.assert_array_equal(simulate(machines, command, first, DT, threads=7), alone)
    with ThreadPoolExecutor(3) as pool:
        for together in pool.map(lambda _: simulate(machines, command, first, DT, threads=2), range(6)):
            np.testing.assert_array_equal(together, alone)
    single = np.concatenate([simulate(m[None], command, first, DT) for m in machines])
    np.testing.assert_array_equal(single, alone)


def test_episodes_end_where_they_end():
    command = commands()
    first = np.array([[0.0, 0.0], [0.5, -1.0], [2.0, 0.3]])
    machine = pack(NOMINAL, {"encoder_quantization": {"resolution": 0.01}})[None]
    states = simulate(machine, command, first, DT, lengths=np.array([300, 0, 120]))[0]
    assert np.isfinite(states[0]).all() and np.isnan(states[1]).all()
    assert np.isfinite(states[2, :120]).all() and np.isnan(states[2, 120:]).all()
    alone = simulate(machine, command[2:, :120], first[2:], DT)[0, 0]
    np.testing.assert_array_equal(states[2, :120], alone)


@pytest.mark.parametrize(
    "effects", [{}, {"backlash": {"width": 0.05}}, {"compliance": {"stiffness": 5, "damping": 0.0}}]
)
def test_an_observer_forgets_where_it_began_and_predicts(effects):
    command = commands(1)
    machine = pack(NOMINAL, effects)[None]
    truth = simulate(machine, command, np.zeros((1, 2)), DT)[0]
    lost = np.array([[0.3, 1.0]])
    observed = truth.copy()
    observed[0, 100:110] = np.nan
    seen = simulate(machine, command, lost, DT, observed=observed, leak=0.1)[0, 0]
    np.testing.assert_array_equal(seen[0], lost[0])  # row 0 is written before anything is added
    np.testing.assert_allclose(seen[-50:], truth[0, -50:], atol=1e-2)
    position, velocity = seen[0] + 0.1 * (truth[0, 0] - seen[0])  # then a tenth of the error goes
    again = simulate(machine, command, np.array([[position, velocity]]), DT)[0, 0, 1]
    np.testing.assert_allclose(seen[1], again, atol=1e-12)


def test_a_machine_is_laid_out_as_its_columns():
    row = pack(NOMINAL, {"inertia": {"value": 0.03}, "cogging": {"amplitude": 0.1, "teeth": 7}})
    named = dict(zip(COLUMNS, row, strict=True))
    assert named["inertia"] == 0.03 and named["cogging.teeth"] == 7 and named["torque_saturation.limit"] == np.inf
    assert {e.name for e in JOINT_EFFECTS if e.source == "dynamics"} == set(DYNAMICS)


def test_bad_input_is_one_line():
    machine, command, first = pack(NOMINAL, {})[None], np.zeros((2, 5)), np.zeros((2, 2))
    with pytest.raises(UserError, match="did you mean 'backlash'"):
        pack(NOMINAL, {"backlas": {"width": 0.1}})
    with pytest.raises(UserError, match="width is -1"):
        pack(NOMINAL, {"backlash": {"width": -1.0}})
    with pytest.raises(UserError, match="inertia"):
        pack(NominalJoint(0.5, 0.0, 0.1, 0.02), {})
    for broken in (machine[:, :-1], machine[0]):
        with pytest.raises(UserError, match="machines are"):
            simulate(broken, command, first, DT)
    with pytest.raises(UserError, match="lengths"):
        simulate(machine, command, first, DT, lengths=np.array([5, 6]))
    with pytest.raises(UserError, match="observed is"):
        simulate(machine, command, first, DT, observed=np.zeros((2, 4, 2)), leak=0.1)
    with pytest.raises(UserError, match="machines are"):
        simulate(machine, command, first, DT, tables=Tables(time=(0, 1, 4)))
    for column, value in (("inertia", -1.0), ("latency.delay", -0.01), ("viscous_damping", np.nan)):
        wrong = machine.copy()
        wrong[0, COLUMNS.index(column)] = value
        with pytest.raises(UserError, match=column):
            simulate(wrong, command, first, DT)


def test_pybullet_has_the_same_joint():
    """The joint that the benchmark compares with; PyBullet's integrator is of first order."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = benchmark.pybullet_joint(client, DT / 40)
        command, states = commands(1, 100)[0], []
        for current in command:
            states.append(pybullet.getJointState(body, 0, physicsClientId=client)[:2])
            for _ in range(40):
                torque = benchmark.JOINT.torque_constant * current
                pybullet.setJointMotorControl2(body, 0, pybullet.TORQUE_CONTROL, force=torque, physicsClientId=client)
                pybullet.stepSimulation(physicsClientId=client)
    finally:
        pybullet.disconnect(client)
    ours = simulate(pack(benchmark.JOINT, {})[None], command[None], np.zeros((1, 2)), DT)[0, 0]
    np.testing.assert_allclose(ours[:, 1], np.array(states)[:, 1], atol=0.02)


@pytest.mark.parametrize("name", ["joint_no_gap", "joint_viscous_damping", "joint_backlash"])
def test_recordings_made_elsewhere_are_reproduced_to_their_noise(name):
    folder = EXAMPLES / name
    recording = yaml.safe_load((folder / "recording.yaml").read_text())
    effects = json.loads((folder / "answer.json").read_text())["effects"]
    rows = np.loadtxt(folder / "joint.csv", delimiter=",", skiprows=1).reshape(5, -1, 5)
    machine = pack(NominalJoint(**recording["nominal"]), effects)[None]
    states = simulate(machine, rows[..., 2], np.zeros((5, 2)), recording["sample_time"])[0]
    error = np.abs(states - rows[..., 3:])
    assert np.median(error[..., 0]) < 6e-4 and np.median(error[..., 1]) < 4e-3
    # Contacts are not quite hard there: the sample that falls on an impact is off by part of its jump.
    assert np.mean(error[..., 1] > 0.025) < (0.06 if "backlash" in effects else 1e-3)


@needs_emps
@pytest.mark.parametrize("name", ["estimation", "validation_pulses"])
def test_a_real_axis_moves_as_its_published_model_says(name):
    folder = EMPS / name
    recording = yaml.safe_load((folder / "recording.yaml").read_text())
    rows = np.loadtxt(folder / "joint.csv", delimiter=",", skiprows=1)
    force, position = rows[:, 2], rows[:, 3]
    first = np.array([[position[0], 0.0]])
    machine = pack(NominalJoint(**recording["nominal"]), {})[None]
    states = simulate(machine, force[None], first, recording["sample_time"])[0, 0]
    assert len(states) > 24000 and np.sqrt(np.mean((states[:, 0] - position) ** 2)) < 0.05 * np.ptp(position)
