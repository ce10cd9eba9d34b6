"""Each effect against its definition: closed forms, and scipy's integrator on the equations written down again."""

import math

import numpy as np
import pytest
from equations import integrate, sign

from vision_s2r.joint import NominalJoint, Tables, pack, simulate

K, J, B, F = 0.5, 0.02, 0.1, 0.02
NOMINAL = NominalJoint(torque_constant=K, inertia=J, viscous_damping=B, coulomb_friction=F)
FRICTIONLESS = NominalJoint(torque_constant=K, inertia=J, viscous_damping=0.0, coulomb_friction=0.0)
DT = 0.01


def run(effects, command, nominal=NOMINAL, first=(0.0, 0.0), **options):
    command = np.asarray(command, dtype=float)
    return simulate(pack(nominal, effects)[None], command[None], np.array([first]), DT, **options)[0, 0]


def steps(seed=0, samples=200, hold=20, size=1.8):
    return np.repeat(np.random.default_rng(seed).uniform(-size, size, samples // hold), hold)


def test_the_nominal_joint_is_its_closed_form():
    time = np.arange(100) * DT
    final = (K * 0.8 - F) / B
    expected = final * (1 - np.exp(-B / J * time))
    states = run({}, np.full(100, 0.8), substeps=1)
    np.testing.assert_allclose(states[:, 1], expected, atol=1e-12)
    np.testing.assert_allclose(states[:, 0], final * time - expected * J / B, atol=1e-12)


def test_dry_friction_stops_the_joint_and_holds_it():
    states = run(
        {"viscous_damping": {"value": 0.0}, "coulomb_friction": {"value": 0.1}}, np.zeros(100), first=(0.0, 2.0)
    )
    stop = 2.0 * J / 0.1  # s; the stopping distance is v²/2a
    assert np.all(states[int(stop / DT) + 1 :, 1] == 0.0)
    assert states[-1, 0] == pytest.approx(2.0**2 / (2 * 0.1 / J), rel=1e-12)
    held = run({"coulomb_friction": {"value": 0.1}}, np.full(100, 0.199))
    assert np.all(held == 0.0)
    assert run({"coulomb_friction": {"value": 0.1}}, np.full(100, 0.201))[-1, 1] > 0


def test_stribeck_holds_up_to_its_static_friction():
    effects = {"stribeck_friction": {"static": 0.2, "velocity": 0.1}}
    assert np.all(run(effects, np.full(50, 0.399)) == 0.0)
    moving = run(effects, np.full(300, 0.401))
    assert moving[-1, 1] == pytest.approx((0.401 * K - F) / B, rel=1e-3)


def test_load_dependent_friction_grows_with_the_torque():
    states = run({"load_dependent_friction": {"coefficient": 0.2}}, np.full(500, 1.0))
    assert states[-1, 1] == pytest.approx((0.8 * K - F) / B, rel=1e-6)


@pytest.mark.parametrize("command", [1.6, -1.6])
def test_the_torque_is_limited(command):
    final = run({"torque_saturation": {"limit": 0.3}}, np.full(500, command))[-1, 1]
    assert final == pytest.approx(math.copysign((0.3 - F) / B, command), rel=1e-6)


def test_the_limit_of_speed_acts_in_the_direction_of_motion_only():
    effects = {"torque_speed_limit": {"stall": 0.7, "no_load_speed": 10.0}}
    ahead = run(effects, np.full(500, 1.6))
    assert ahead[-1, 1] == pytest.approx((0.7 - F) / (B + 0.07), rel=1e-6)
    braking = run(effects, np.full(2, -1.2), first=(0.0, 5.0))
    all_of_it = run({}, np.full(2, -1.2), first=(0.0, 5.0))  # less than stall
    np.testing.assert_allclose(braking, all_of_it, rtol=1e-12)
    beyond = run(effects, np.full(2, 1.2), first=(0.0, 12.0))
    assert beyond[1, 1] == pytest.approx(run({}, np.zeros(2), first=(0.0, 12.0))[1, 1], rel=1e-12)


def test_latency_is_no_multiple_of_the_sample_time():
    delay = 0.0137
    states = run({"latency": {"delay": delay}}, np.full(40, 0.8), nominal=FRICTIONLESS)
    late = np.maximum(np.arange(40) * DT - delay, 0)
    np.testing.assert_allclose(states[:, 1], 0.8 * K / J * late, atol=1e-12)
    np.testing.assert_allclose(states[:, 0], 0.5 * 0.8 * K / J * late**2, atol=1e-12)


def test_latency_is_continuous_where_it_passes_a_sample():
    command = steps()
    at, below, above = (run({"latency": {"delay": d}}, command) for d in (0.02, 0.02 - 1e-9, 0.02 + 1e-9))
    np.testing.assert_allclose(below, at, atol=1e-6)
    np.testing.assert_allclose(above, at, atol=1e-6)


def test_the_encoder_rounds_position_and_differentiates_it():
    command = steps()
    exact, shown = run({}, command), run({"encoder_quantization": {"resolution": 0.05}}, command)
    lattice = shown[:, 0] / 0.05
    np.testing.assert_allclose(lattice, np.round(lattice), atol=1e-9)
    assert np.abs(shown[:, 0] - exact[:, 0]).max() <= 0.025 + 1e-12
    np.testing.assert_allclose(shown[1:-1, 1], (shown[2:, 0] - shown[:-2, 0]) / (2 * DT), atol=1e-12)
    assert shown[0, 1] == pytest.approx((shown[1, 0] - shown[0, 0]) / DT)
    assert shown[-1, 1] == pytest.approx((shown[-1, 0] - shown[-2, 0]) / DT)


def test_play_is_crossed_alone_and_ends_in_an_inelastic_impact():
    width, torque = 0.04, 0.4
    states = run({"backlash": {"width": width}}, np.full(40, torque / K), nominal=FRICTIONLESS)
    crossing = math.sqrt(2 * (width / 2) / (torque / (J / 2)))  # the motor alone, from the middle of the play
    speed = torque / (J / 2) * crossing / 2  # shared with the load
    after = np.maximum(np.arange(40) * DT - crossing, 0)
    moving = np.where(after > 0, speed + torque / J * after, 0)
    np.testing.assert_allclose(states[:, 1], moving, atol=1e-12)
    np.testing.assert_allclose(states[:, 0], speed * after + 0.5 * torque / J * after**2, atol=1e-12)


def test_a_load_coasts_through_the_play_when_the_motor_brakes():
    """Friction acts on the motor only, so that the load keeps its speed until the other side of the play."""
    command = np.r_[np.full(100, 0.8), np.zeros(100)]
    states = run({"backlash": {"width": 0.2}}, command)
    coasting = states[101:104, 1]
    assert np.all(coasting == coasting[0]) and coasting[0] == pytest.approx(states[100, 1])
    assert np.all(np.diff(run({}, command)[100:104, 1]) < 0)


def test_a_load_hangs_on_one_side_of_the_play():
    effects = {"backlash": {"width": 0.02}, "gravity_torque": {"value": 0.3}, "coulomb_friction": {"value": 10.0}}
    states = run(effects, np.zeros(300), first=(1.0, 0.0))
    assert states[-1, 0] == pytest.approx(0.99, abs=3e-4) and np.all(states[-200:, 1] == 0.0)


def test_narrow_play_and_a_stiff_spring_are_the_rigid_joint():
    command = steps()
    rigid = run({}, command)
    np.testing.assert_allclose(run({"backlash": {"width": 1e-6}}, command), rigid, atol=1e-3)
    stiff = run({"compliance": {"stiffness": 1e6, "damping": 1.0}}, command)
    np.testing.assert_allclose(stiff, rigid, atol=1e-3)


def one_mass_rates(time, state, current):
    """Gravity, bias, cogging, Stribeck, load-dependent, asymmetric friction, drift and the motor's limits at once."""
    position, velocity = state
    ahead = max(0.75 * (1 - abs(velocity) / 9.0), 0.0)
    low, high = (-0.75, ahead) if velocity >= 0 else (-ahead, 0.75)
    motor = min(max(min(max(K * current, -0.7), 0.7), low), high)
    side = sign(velocity)
    coulomb = F + 0.01 * side
    dry = coulomb + (0.06 - coulomb) * math.exp(-((velocity / 0.3) ** 2)) + 0.1 * abs(motor)
    damping = (B + 0.02 * side) * (1 + 0.08 * time)
    torque = motor + 0.05 * math.sin(9.0 * position) - 0.08 * math.sin(position) - 0.015
    return np.array([velocity, (torque - damping * velocity - dry * side) / J])


ONE_MASS = {
    "torque_speed_limit": {"stall": 0.75, "no_load_speed": 9.0},
    "torque_saturation": {"limit": 0.7},
    "asymmetric_friction": {"viscous": 0.02, "coulomb": 0.01},
    "stribeck_friction": {"static": 0.06, "velocity": 0.3},
    "load_dependent_friction": {"coefficient": 0.1},
    "thermal_drift": {"rate": 0.08},
    "cogging": {"amplitude": 0.05, "teeth": 9.0},
    "gravity_torque": {"value": 0.08},
    "bias_torque": {"value": 0.015},
}


def two_mass_rates(time, state, current):
    """A spring with asymmetric friction, drift and cogging on the motor, gravity and bias on the load."""
    motor_position, motor_velocity, position, velocity = state
    spring = 6.0 * (motor_position - position) + 0.02 * (motor_velocity - velocity)
    side = sign(motor_velocity)
    damping = (B + 0.02 * side) * (1 + 0.08 * time)
    torque = K * current + 0.05 * math.sin(9.0 * motor_position) - damping * motor_velocity - (F + 0.01 * side) * side
    load = -0.08 * math.sin(position) - 0.015
    return np.array(
        [motor_velocity, (torque - spring) / (J / 2), velocity, (load + spring) / (J / 2)],
    )


TWO_MASSES = {
    "compliance": {"stiffness": 6.0, "damping": 0.02},
    **{k: ONE_MASS[k] for k in ("asymmetric_friction", "thermal_drift", "cogging", "gravity_torque", "bias_torque")},
}


@pytest.mark.parametrize(
    ("effects", "rates", "size"),
    [(ONE_MASS, one_mass_rates, 2), (TWO_MASSES, two_mass_rates, 4)],
    ids=["one mass", "two masses"],
)
def test_all_effects_at_once_are_what_another_integrator_makes_of_them(effects, rates, size):
    command = steps(seed=3, samples=120, size=1.7)
    expected = integrate(rates, np.zeros(size), command, DT)[:, -2:]
    states = run(effects, command)
    assert np.sqrt(np.mean((states - expected) ** 2, axis=0)) == pytest.approx([0, 0], abs=1e-3)
    assert np.ptp(expected[:, 1]) > 5  # and it did move


def test_tables_add_their_torque():
    """A table over velocity with the slope of damping is damping; over time and position, what they say."""
    command = np.full(60, 0.8)
    tables = Tables(velocity=(-10.0, 10.0, 5), time=(0.0, 0.6, 2))
    slope = -0.05 * np.linspace(-10, 10, 5)
    machine = np.r_[pack(NOMINAL, {}), slope, 0.0, 0.06]
    states = simulate(machine[None], command[None], np.zeros((1, 2)), DT, tables=tables)[0, 0]

    def rates(time, state, current):
        torque = K * current - F - (B + 0.05) * state[1] + 0.1 * time
        return np.array([state[1], torque / J])

    np.testing.assert_allclose(states, integrate(rates, np.zeros(2), command, DT), atol=1e-4)
    flat = Tables(position=(-1.0, 1.0, 3))
    biased = simulate(
        np.r_[pack(NOMINAL, {}), np.full(3, -0.03)][None], command[None], np.zeros((1, 2)), DT, tables=flat
    )
    np.testing.assert_allclose(biased[0, 0], run({"bias_torque": {"value": 0.03}}, command), atol=1e-12)
    # A drive that gives 0.3 N·m less than it is to give, whichever way, beyond 0.3 N·m, and nothing below.
    command, knots = np.where(np.arange(60) < 30, 0.8, -0.8), np.linspace(-1, 1, 41)
    dead = Tables(torque=(-1.0, 1.0, 41))
    machine = np.r_[pack(NOMINAL, {}), -np.sign(knots) * np.minimum(knots**2, 0.3)]
    states = simulate(machine[None], command[None], np.zeros((1, 2)), DT, tables=dead)[0, 0]
    less = run({}, np.sign(command) * (0.8 * K - 0.3) / K)
    np.testing.assert_allclose(states, less, atol=2e-3 * np.ptp(less))


def test_gravity_is_a_sine_at_any_angle():
    angles = np.linspace(-1000, 1000, 4001)
    first = np.stack([angles, np.zeros(len(angles))], axis=1)
    machine = pack(FRICTIONLESS, {"gravity_torque": {"value": J}})[None]
    states = simulate(machine, np.zeros((len(angles), 2)), first, 1e-3)[0]
    np.testing.assert_allclose(states[:, 1, 1], -1e-3 * np.sin(angles), atol=1e-15)
