"""Position servos, uneven samples, torques from outside: against the equations written down again, in fine steps."""

import math
from dataclasses import replace

import numba
import numpy as np
import pytest
from scipy.linalg import expm

from vision_s2r.errors import UserError
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.joint.effects import acceleration_limit, velocity_limit

SERVO = NominalJoint(
    torque_constant=0.9,
    inertia=0.03,
    viscous_damping=0.3,
    coulomb_friction=0.05,
    gravity_torque=0.4,
    bias_torque=0.02,
    proportional_gain=12.0,
    command_limit=3.0,
)
FREE = NominalJoint(1.0, 0.03, 0.3, 0.0, proportional_gain=12.0)
FINE = 1e-5  # s, of the reference


@numba.njit
def profile(place, rate, target, fastest, steepest, time):  # compiled code is called by compiled code
    return acceleration_limit.along(velocity_limit.profile(place, rate, target, fastest, steepest), time)


def uneven(rate, seconds, seed=0):
    """Times that jitter by a fifth of a sample, with a gap of six in the middle."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(rate * seconds)) / rate + rng.uniform(0, 0.2 / rate, int(rate * seconds))
    return np.delete(t, np.s_[len(t) // 2 : len(t) // 2 + 6])


def steps(times, seed=1, every=0.6, size=0.8):
    """Targets that jump every now and then, at samples."""
    levels = np.random.default_rng(seed).uniform(-size, size, int(times[-1] / every) + 2)
    levels[0] = 0
    return levels[((times - times[0]) / every).astype(int)]


def run(nominal, effects, times, target, first=(0.0, 0.0), **options):
    machine = pack(nominal, effects)[None]
    mean = float(np.median(np.diff(times)))
    return simulate(machine, target[None], np.array([first]), mean, times=times[None], **options)[0, 0]


def reference(nominal, effects, times, target, external=None, scale=None):
    """Semi-implicit Euler in steps of FINE, one mass; friction is clamped to what stops the joint."""
    n, e = nominal, {name: effects.get(name, {}) for name in (*effects, "latency", "deadband", "stribeck_friction")}
    e |= {name: effects.get(name, {}) for name in ("velocity_limit", "acceleration_limit", "encoder_quantization")}
    loaded = ("load_dependent_stribeck", "load_dependent_friction", "external_load_friction")
    e |= {name: effects.get(name, {}) for name in loaded}
    kick = effects.get("derivative_on_error", {"gain": 0.0, "time_constant": 1.0})
    q = v = place = rate = lagged = 0.0
    rows, times = [], times - times[0]
    delay, dead = e["latency"].get("delay", 0.0), e["deadband"].get("width", 0.0) / 2
    fastest, steepest = (e[name].get("value", math.inf) for name in ("velocity_limit", "acceleration_limit"))
    resolution, offset = e["encoder_quantization"].get("resolution", 0.0), effects.get("position_offset", {"value": 0})
    moment = np.arange(int(times[-1] / FINE) + 1) * FINE
    now = np.searchsorted(times, moment + 1e-9, side="right") - 1
    late = np.searchsorted(times, moment - delay + 1e-9, side="right") - 1
    states = np.empty((len(moment), 2))
    for k in range(len(moment)):
        states[k] = q, v
        goal = target[late[k]] if late[k] >= 0 else 0.0
        if math.isfinite(fastest + steepest):
            way = goal - place
            want = math.copysign(min(fastest, math.sqrt(2 * steepest * abs(way))), way)
            rate += min(max(want - rate, -steepest * FINE), steepest * FINE)
            place += FINE * rate
            goal = place
        shown = resolution * math.floor(q / resolution + 0.5) if resolution else q
        error = goal - shown
        change = (error - lagged) / kick["time_constant"]
        lagged += FINE * change
        error = math.copysign(max(abs(error) - dead, 0.0), error)
        u = n.proportional_gain * error - (n.derivative_gain * v if error or not dead else 0.0)
        u += kick["gain"] * change if error or not dead else 0.0
        u = min(max(u, -n.command_limit), n.command_limit) * (1.0 if scale is None else scale[now[k]])
        motor = n.torque_constant * u
        if scale is None or scale[now[k]] > 0:
            motor -= effects.get("back_emf", {"value": 0.0})["value"] * v
        dry = n.coulomb_friction
        if e["stribeck_friction"]:
            s = e["stribeck_friction"]
            dry += (s["static"] - dry) * math.exp(-((v / s["velocity"]) ** 2))
        load = 0.0 if external is None else external[now[k]]
        load -= n.gravity_torque * math.sin(q - offset["value"]) + n.bias_torque
        pressed = e["load_dependent_friction"].get("coefficient", 0.0) * motor
        if e["load_dependent_stribeck"]:
            s = e["load_dependent_stribeck"]
            pressed += s["coefficient"] * motor * math.exp(-((v / s["velocity"]) ** 2))
        dry += abs(pressed - e["external_load_friction"].get("coefficient", 0.0) * load)
        free = v + FINE * (motor + load - n.viscous_damping * v) / n.inertia
        stop = FINE * dry / n.inertia
        v = 0.0 if abs(free) <= stop else free - math.copysign(stop, free)
        q += FINE * v
    rows = np.stack([np.interp(times, moment, states[:, 0]), np.interp(times, moment, states[:, 1])], axis=1)
    if resolution:
        rows[:, 0] = resolution * np.floor(rows[:, 0] / resolution + 0.5)
    return rows


@pytest.mark.parametrize("rate", [25.0, 50.0, 200.0])
def test_a_linear_servo_is_its_matrix_exponential_at_any_time_stamps(rate):
    times = uneven(rate, 4.0)
    target = steps(times)
    a = np.array([[0, 1, 0], [-12 / 0.03, -0.3 / 0.03, 12 / 0.03], [0, 0, 0]])
    state, expected = np.zeros(2), [np.zeros(2)]
    for goal, span in zip(target, np.diff(times), strict=False):
        state = (expm(a * span) @ [*state, goal])[:2]
        expected.append(state)
    states = run(FREE, {}, times, target)
    assert np.abs(states - expected)[:, 0].max() < 1e-3 and np.ptp(states[:, 0]) > 1
    finer = run(FREE, {}, times, target, substeps=round(4000 / rate))
    assert np.abs(finer - expected)[:, 0].max() < 1e-4  # of second order in the step


CASES = {
    "friction and gravity": {},
    "latency": {"latency": {"delay": 0.0143}},
    "deadband": {"deadband": {"width": 0.06}},
    "profile": {"velocity_limit": {"value": 1.2}, "acceleration_limit": {"value": 9.0}},
    "derivative on the error": {"derivative_on_error": {"gain": 0.15, "time_constant": 0.015}},
    "a kick, clipped": {"derivative_on_error": {"gain": 0.15, "time_constant": 0.003}, "latency": {"delay": 0.0143}},
    "quantization": {"encoder_quantization": {"resolution": 0.02}},
    "frictions": {
        "stribeck_friction": {"static": 0.12, "velocity": 0.3},
        "load_dependent_friction": {"coefficient": 0.05},
        "load_dependent_stribeck": {"coefficient": 0.1, "velocity": 0.2},
    },
    "gears between two torques": {
        "load_dependent_friction": {"coefficient": 0.1},
        "external_load_friction": {"coefficient": 0.25},
    },
    "zero": {"position_offset": {"value": 0.4}},
}


@pytest.mark.parametrize("name", CASES)
def test_each_effect_in_the_loop_is_what_fine_steps_make_of_it(name):
    nominal = replace(SERVO, derivative_gain=0.03)
    times = uneven(40.0, 2.4)
    target = steps(times)
    expected = reference(nominal, CASES[name], times, target)
    states = run(nominal, CASES[name], times, target)
    apart = np.sqrt(np.mean((states - expected)[:, 0] ** 2))
    assert apart < (6e-3 if name == "quantization" else 6e-4), apart  # a chattering law is followed roughly
    if CASES[name]:
        assert np.sqrt(np.mean((run(nominal, {}, times, target) - expected)[:, 0] ** 2)) > 5 * apart


@pytest.mark.parametrize("effects", [{}, {"back_emf": {"value": 0.25}}])
def test_a_pull_a_supply_and_a_drive_that_is_switched_off(effects):
    times = uneven(50.0, 2.4)
    target = steps(times)
    external = np.where(times > 0.9, 0.5, 0.0) * np.sin(9 * times)
    scale = np.where(times > 1.6, 0.0, 1 - 0.2 * (times > 0.5))
    expected = reference(SERVO, effects, times, target, external, scale)
    states = run(SERVO, effects, times, target, external=external[None], scale=scale[None], substeps=40)
    assert np.abs(states - expected)[:, 0].max() < 2e-3
    for without in ({"external": external[None]}, {"scale": scale[None]}):
        assert np.abs(run(SERVO, effects, times, target, **without) - expected)[:, 0].max() > 0.02


@pytest.mark.parametrize("effects", [{}, {"backlash": {"width": 0.05}}, {"latency": {"delay": 0.013}}])
def test_how_often_a_servo_is_logged_changes_nothing_of_how_it_moves(effects):
    fast = np.arange(3000) * 1e-3
    slow = fast[::40]
    target = np.repeat(steps(slow), 40)
    often, seldom = run(SERVO, effects, fast, target, substeps=1), run(SERVO, effects, slow, target[::40], substeps=40)
    np.testing.assert_allclose(often[::40], seldom, atol=1e-9)


def test_a_torque_held_between_samples_needs_no_clock():
    """The two ways through the simulator: steps ruled by samples, and on a clock of their own."""
    command = np.repeat(np.random.default_rng(3).uniform(-1.5, 1.5, 15), 20)
    nominal = NominalJoint(0.5, 0.02, 0.1, 0.02, gravity_torque=0.1)
    for effects in ({"backlash": {"width": 0.03}}, {"compliance": {"stiffness": 5.0, "damping": 0.01}}, {}):
        machine = pack(nominal, effects)[None]
        ruled = simulate(machine, command[None], np.zeros((1, 2)), 0.01)[0, 0]
        clocked = run(nominal, effects, np.arange(300) * 0.01, command)
        np.testing.assert_allclose(clocked, ruled, atol=1e-10)


def test_a_stiff_spring_in_the_loop_is_the_rigid_servo_and_a_soft_one_is_not():
    times = uneven(100.0, 3.0)
    target = steps(times)
    rigid = run(SERVO, {}, times, target)
    stiff = run(SERVO, {"compliance": {"stiffness": 1e5, "damping": 1.0}}, times, target)
    assert np.abs(stiff - rigid)[:, 0].max() < 2e-3
    soft = run(SERVO, {"compliance": {"stiffness": 5.0, "damping": 0.01}}, times, target)
    assert np.abs(soft - rigid)[:, 0].max() > 0.05


def test_an_observer_of_a_servo_forgets_where_it_began():
    times = uneven(50.0, 4.0)
    target = steps(times)
    truth = run(SERVO, {}, times, target)
    led = run(SERVO, {}, times, target, first=(0.5, 2.0), observed=truth[None], leak=0.1)
    assert led[0].tolist() == [0.5, 2.0] and np.abs(led - truth)[-40:, 0].max() < 1e-3


def test_a_profile_is_exact_whatever_its_steps():
    """A trapezoid over 2 rad, a triangle over 0.1 rad, and a target that moves behind the set point."""
    place, rate = profile(0.0, 0.0, 2.0, 1.0, 4.0, 1.0)
    assert (place, rate) == pytest.approx((0.125 + 0.75, 1.0))
    assert profile(0.0, 0.0, 2.0, 1.0, 4.0, 2.25) == pytest.approx((2.0, 0.0))
    top = math.sqrt(0.1 * 4.0)
    assert profile(0.0, 0.0, 0.1, 1.0, 4.0, top / 4.0) == pytest.approx((0.05, top))
    assert profile(0.3, 1.0, 0.2, 1.0, 4.0, 60.0) == pytest.approx((0.2, 0.0))
    rng = np.random.default_rng(0)
    for _ in range(40):
        start, speed, goal = rng.uniform(-1, 1, 3) * (1, 0.8, 1)
        at = start, speed
        for _ in range(37):
            at = profile(*at, goal, 0.8, 3.0, 0.02)
        assert at == pytest.approx(profile(start, speed, goal, 0.8, 3.0, 37 * 0.02), abs=1e-9)


def test_what_cannot_be_a_servo_is_said_in_one_line():
    times, plain = np.arange(20) * 0.02, NominalJoint(0.5, 0.02, 0.1, 0.02)
    with pytest.raises(UserError, match="deadband is of a position servo"):
        pack(plain, {"deadband": {"width": 0.1}})
    both = np.stack([pack(plain, {}), pack(SERVO, {})])
    with pytest.raises(UserError, match="some machines are position servos"):
        simulate(both, np.zeros((1, 20)), np.zeros((1, 2)), 0.02)
    with pytest.raises(UserError, match="times do not rise"):
        simulate(both[1:], np.zeros((1, 20)), np.zeros((1, 2)), 0.02, times=times[None, ::-1])
    with pytest.raises(UserError, match=r"external is \(1, 3\), expected \(1, 20\)"):
        run(SERVO, {}, times, np.zeros(20), external=np.zeros((1, 3)))
    with pytest.raises(UserError, match="command_limit"):
        pack(replace(SERVO, command_limit=-1.0), {})
