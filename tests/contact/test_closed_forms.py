"""The simulator against what is known in closed form, or of one ordinary differential equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vision_s2r.contact import CONTACT_EFFECTS, NominalContact, Terms, box, cylinder, pack, simulate, sphere
from vision_s2r.errors import UserError

G = 9.81
DT = 1 / 148
CUBE = box((0.0524,) * 3)


def nominal(friction=0.2, restitution=0.0):
    return NominalContact(mass=0.37, lateral_friction=friction, restitution=restitution, gravity=G)


def state(position, velocity=(0, 0, 0), spin=(0, 0, 0), attitude=(0, 0, 0, 1)):
    return np.array([[*position, *attitude, *velocity, *spin]], dtype=float)


def motion(machine, shape, first, samples=148, effects=None, **more):
    return simulate(pack(machine, effects or {})[None], shape, first, samples, DT, **more)[0, 0]


def tilted(angle):
    """An attitude turned about the y axis."""
    return 0.0, float(np.sin(angle / 2)), 0.0, float(np.cos(angle / 2))


def test_a_sliding_block_stops_where_coulomb_says():
    for friction in (0.1, 0.18, 0.6):
        out = motion(nominal(friction), CUBE, state((0, 0, 0.0524), (0.8, 0.6, 0)), 200)
        distance = 1 / (2 * friction * G)
        assert out[-1, :2] == pytest.approx((0.8 * distance, 0.6 * distance), rel=1e-3)
        assert np.abs(out[-1, 7:]).max() < 1e-4 and out[-1, 2] == pytest.approx(0.0524, abs=1e-6)


def test_a_ball_bounces_to_the_square_of_its_restitution():
    for restitution in (0.3, 0.8):
        out = motion(nominal(0.2, restitution), sphere(0.05), state((0, 0, 0.55)), 300, substeps=7)
        height = out[:, 2] - 0.05
        peaks = [height[k] for k in range(1, 299) if height[k - 1] < height[k] >= height[k + 1]]
        assert peaks[:2] == pytest.approx([0.5 * restitution**2, 0.5 * restitution**4], abs=3e-4)


def test_a_rocking_block_falls_as_a_pendulum_and_turns_over_the_other_edge_with_housners_loss():
    half = np.array([0.03, 0.05, 0.09])
    alpha, reach = np.arctan2(half[0], half[2]), np.hypot(half[0], half[2])
    start = 0.1
    block = box(tuple(half))
    # It leans on its edge at x = +half: the centre lies at (-reach·sin, reach·cos) of alpha - start from it.
    where = (half[0] - reach * np.sin(alpha - start), 0.0, reach * np.cos(alpha - start))
    out = motion(nominal(2.0), block, state(where, attitude=tilted(start)), 40, substeps=20)
    angle = 2 * np.arctan2(out[:, 4], out[:, 6])

    def pendulum(_, y):
        return y[1], -0.75 * G / reach * np.sin(alpha - y[0])

    steps = np.arange(40) * DT
    exact = solve_ivp(pendulum, (0, 0.3), [start, 0.0], t_eval=steps, rtol=1e-10, atol=1e-12).y
    before = exact[0] > 0.005
    assert 10 < before.sum() < 39 and np.abs(angle - exact[0])[before].max() < 2e-4
    landing = solve_ivp(pendulum, (0, 1), [start, 0.0], events=[lambda t, y: y[0]], rtol=1e-10, atol=1e-12).y_events[0][
        0, 1
    ]
    leaning, spin = -angle[angle < -1e-6][0], out[:, 11][angle < -1e-6][0]
    climbed = 1.5 * G / reach * (np.cos(alpha - leaning) - np.cos(alpha))  # since the impact
    assert -np.sqrt(spin**2 + climbed) / landing == pytest.approx(1 - 1.5 * np.sin(alpha) ** 2, rel=0.01)


def test_rolling_and_spinning_are_braked_by_a_length_times_the_weight():
    effects = {"rolling_friction": {"value": 0.002}}
    out = motion(nominal(0.5), sphere(0.05), state((0, 0, 0.05), (1, 0, 0), (0, 20, 0)), 148, effects)
    braking = 5 / 7 * 0.002 / 0.05 * G
    assert out[-1, 7] == pytest.approx(1 - braking * 147 * DT, rel=1e-3)
    assert out[-1, 11] == pytest.approx(out[-1, 7] / 0.05, rel=1e-4)
    effects = {"spinning_friction": {"value": 0.003}}
    out = motion(nominal(0.5), sphere(0.05), state((0, 0, 0.05), spin=(0, 0, 30)), 40, effects)
    assert out[-1, 12] == pytest.approx(30 - 0.003 * G / (0.4 * 0.05**2) * 39 * DT, rel=1e-3)


def test_a_ball_that_hits_sliding_leaves_as_coulombs_impulse_has_it():
    out = motion(nominal(0.1, 0.5), sphere(0.05), state((0, 0, 0.06), (2, 0, -1)), 8)
    fall = np.sqrt(1 + 2 * G * 0.01)
    assert out[-1, 7] == pytest.approx(2 - 0.1 * 1.5 * fall, rel=1e-6)
    assert out[-1, 11] == pytest.approx(0.1 * 1.5 * fall * 0.05 / (0.4 * 0.05**2), rel=1e-6)


def test_a_rounded_corner_comes_down_later_and_a_face_where_it_did():
    half, radius = 0.0524, 0.01
    effects = {"corner_radius": {"value": radius}}
    upright = (np.sin(np.arctan(np.sqrt(2)) / 2), np.cos(np.arctan(np.sqrt(2)) / 2))  # a diagonal is vertical
    axis = upright[0] / np.sqrt(2)
    on_corner = state((0, 0, 0.3), attitude=(axis, -axis, 0, upright[1]))
    out = motion(nominal(0.5, 0.5), CUBE, on_corner, 60, effects, substeps=7)
    height = np.sqrt(3) * (half - radius) + radius
    hit = np.sqrt(2 * (0.3 - height) / G)
    k = int(np.ceil(hit / DT))
    later = k * DT - hit
    assert out[k, 2] == pytest.approx(height + 0.5 * G * hit * later - 0.5 * G * later**2, abs=1e-5)
    assert motion(nominal(), CUBE, state((0, 0, 0.08)), 60, effects)[-1, 2] == pytest.approx(half, abs=1e-6)


def test_a_compliant_contact_is_a_spring_with_a_damper_that_never_pulls():
    stiffness, damping = 5e3, 4.0
    effects = {"contact_compliance": {"stiffness": stiffness, "damping": damping}}
    out = motion(nominal(), sphere(0.05), state((0, 0, 0.15)), 60, effects)

    def falling(_, y):
        push = max(0.0, -stiffness * y[0] - damping * y[1]) if y[0] < 0 else 0.0
        return y[1], push / 0.37 - G

    steps = np.arange(60) * DT
    exact = solve_ivp(falling, (0, 0.41), [0.1, 0.0], t_eval=steps, max_step=1e-4, rtol=1e-9).y
    assert np.abs(out[:, 2] - 0.05 - exact[0]).max() < 2e-4
    out = motion(nominal(), CUBE, state((0, 0, 0.0524)), 300, effects)
    assert out[-1, 2] == pytest.approx(0.0524 - 0.37 * G / (4 * stiffness), abs=1e-6)


def test_a_tilted_support_lets_a_block_slide():
    for roll, pitch, axis in ((0.3, 0.0, 1), (0.0, 0.3, 0)):
        effects = {"support_tilt": {"roll": roll, "pitch": pitch}}
        out = motion(nominal(0.1), CUBE, state((0, 0, 0.0524)), 60, effects)
        speed = (np.sin(0.3) - 0.1 * np.cos(0.3)) * G * 59 * DT
        assert abs(out[-1, 7 + axis]) == pytest.approx(speed, rel=1e-3)
        assert np.sign(out[-1, 7 + axis]) == (-1 if axis else 1)
        held = motion(nominal(0.35), CUBE, state((0, 0, 0.0524)), 60, effects)
        assert np.abs(held[-1, :2]).max() < 1e-4


def test_a_thrown_body_turns_about_its_centre_of_mass():
    offset = np.array([0.01, -0.02, 0.015])
    effects = {"center_of_mass": dict(zip("xyz", offset, strict=True))}
    out = motion(nominal(), CUBE, state((0, 0, 5), (1, 0, 2), (0, 0, 6)), 60, effects)
    turn = 6 * np.arange(60) * DT
    turned = np.stack([np.cos(turn) * 0.01 + np.sin(turn) * 0.02, np.sin(turn) * 0.01 - np.cos(turn) * 0.02], axis=1)
    center = out[:, :2] + turned
    straight = np.diff(center, axis=0)
    assert np.abs(straight - straight[0]).max() < 1e-9


def test_a_free_brick_keeps_its_angular_momentum_and_energy():
    brick = box((0.06, 0.04, 0.02))
    out = motion(nominal(), brick, state((0, 0, 9), spin=(3, 12, 5)), 148)
    x, y, z, w = out[:, 3:7].T
    rotation = np.stack(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
    inertia = rotation @ brick.inertia @ rotation.transpose(0, 2, 1)
    momentum = np.einsum("tij,tj->ti", inertia, out[:, 10:])
    assert np.linalg.norm(momentum - momentum[0], axis=1).max() < 2e-3 * np.linalg.norm(momentum[0])


def test_nothing_rests_in_the_support_or_over_it():
    rng = np.random.default_rng(1)
    for shape in (CUBE, sphere(0.05), cylinder(0.03, 0.08)):
        attitude = rng.normal(size=(12, 4))
        first = np.zeros((12, 13))
        first[:, 2], first[:, 3:7] = 0.15, attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
        first[:, 7:] = rng.normal(size=(12, 6))
        machine = pack(nominal(0.4, 0.3), {"rolling_friction": {"value": 0.002}})
        out = simulate(machine[None], shape, first, 300, DT)[0]
        lowest = shape.lowest(out[..., :3], out[..., 3:7])
        assert lowest.min() > (-3e-4 if shape.kind == "cylinder" else -1e-5) and np.abs(lowest[:, -1]).max() < 1e-5
        if shape.kind != "sphere":  # a ball rolls on
            assert np.abs(out[:, -1, 7:12]).max() < 0.05


def test_every_effect_and_term_shows_and_a_neutral_one_does_not():
    rng = np.random.default_rng(2)
    first = np.repeat(state((0, 0, 0.09), (1, 0.4, 0), (3, -4, 5)), 3, axis=0)
    first[:, 3:7] = [q / np.linalg.norm(q) for q in rng.normal(size=(3, 4))]

    def tossed(effects):
        return simulate(pack(nominal(0.2, 0.2), effects)[None], CUBE, first, 60, DT)[0]

    plain = tossed({})
    for effect in CONTACT_EFFECTS:
        change = tossed({effect.name: effect.moderate()})[..., :3] - plain[..., :3]
        assert np.sqrt(np.mean(change**2)) > 5e-4, effect.name
        neutral = {p.name: p.moderate if p.neutral is None else p.neutral for p in effect.parameters}
        if effect.name not in ("lateral_friction", "restitution"):
            assert np.array_equal(tossed({effect.name: neutral}), plain), effect.name
    every = {"height": (0.01, 4), "place": (0.0, 0.0), "speed": (2.0, 3), "time": (0.5, 4), "direction": True}
    every |= {"area": (0.0, 0.0), "sliding": (2.0, 3), "age": (0.5, 3)}
    for name, value in every.items():
        terms = Terms(**{name: value})
        row = np.concatenate([pack(nominal(0.2, 0.2), {}), np.zeros(terms.width)])
        nothing, something = (
            simulate(np.append(row[: -terms.width], [size] * terms.width)[None], CUBE, first, 60, DT, terms=terms)[0]
            for size in (0.0, 0.5)
        )
        assert np.abs(nothing - plain).max() < 1e-3 and np.abs(something - plain)[..., :3].max() > 2e-3, name


def test_the_same_bits_whatever_the_number_of_threads_and_one_line_for_bad_input():
    first = np.repeat(state((0, 0, 0.1), (1, 0, 0), (3, 2, 1)), 5, axis=0)
    machines = np.stack([pack(nominal(f, 0.2), {}) for f in (0.1, 0.2, 0.3)])
    one, two = (simulate(machines, CUBE, first, 50, DT, threads=threads) for threads in (1, 2))
    assert one.tobytes() == two.tobytes()
    with pytest.raises(UserError, match="machines are"):
        simulate(machines[:, 1:], CUBE, first, 50, DT)
    with pytest.raises(UserError, match="expected a mass above 0"):
        pack(NominalContact(0.0, 0.1, 0.1), {})
    with pytest.raises(UserError, match="did you mean 'restitution'"):
        pack(nominal(), {"restitutoin": {"value": 0.1}})
