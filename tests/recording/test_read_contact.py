"""Contact recordings: what is right comes back as it was, what is wrong is one line that says so."""

import dataclasses

import numpy as np
import pytest
from recordings import REAL, a_contact, edit, refused
from scipy.spatial.transform import Rotation

from vision_s2r.contact import NominalContact, cylinder, mesh, pack, simulate, sphere
from vision_s2r.errors import UserError
from vision_s2r.recording import read, split, write
from vision_s2r.recording.contactnets import read_contactnets

TOSSES = REAL / "cube_tosses" / "cube_tosses.npz"
TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.fixture
def contact_folder(tmp_path):
    return write(a_contact(), tmp_path / "contact")


def test_it_comes_back_as_it_was_written(tmp_path):
    one = a_contact()
    uneven = dataclasses.replace(one, lengths=np.array([60, 30, 40, 60]), episodes=(4, 1, 2, 9))
    for k, length in enumerate(uneven.lengths):
        for values in (uneven.position, uneven.attitude, uneven.velocity):
            values[k, length:] = np.nan
    again = read(write(uneven, tmp_path / "out"))
    assert again.nominal == uneven.nominal and again.episodes == (4, 1, 2, 9) and again.shape.kind == "box"
    for name in ("position", "attitude", "velocity", "lengths"):
        np.testing.assert_allclose(getattr(again, name), getattr(uneven, name), rtol=1e-7, atol=1e-8)
    some = split(again, [2, 1])
    assert some.position.shape == (2, 40, 3) and some.episodes == (2, 1)


def test_every_shape_comes_back(tmp_path):
    (tmp_path / "tetrahedron.obj").write_text(TETRAHEDRON)
    solid = mesh(tmp_path / "tetrahedron.obj")
    assert np.trace(solid.inertia) == pytest.approx(2 * 3 * 0.1**2 * 3 / 80, rel=1e-9)
    for shape in (sphere(0.05), cylinder(0.04, 0.07), solid):
        one = a_contact(False, shape=shape)
        again = read(write(one, tmp_path / shape.kind))
        assert again.velocity is None
        np.testing.assert_allclose(
            again.shape.lowest(again.position, again.attitude), shape.lowest(one.position, one.attitude), atol=1e-7
        )
        np.testing.assert_allclose(again.shape.inertia, shape.inertia, atol=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("lateral_friction", "latteral_friction", "unknown key 'latteral_friction', did you mean 'lateral_friction'"),
        ("shape: box", "shape: cube", "shape is 'cube'"),
        ("shape: box", "shape: sphere", "unknown key 'half_extents'"),
        ("restitution: 0.2", "restitution: 1.2", "restitution is '1.2', expected a number"),
        ("mass: 0.37", "mass: 0", "mass is '0', expected a number above 0"),
        ("  mass: 0.37\n", "", "nominal: missing mass"),
        ("sample_time: 0.01", "sample_time: 0.02", "rows every 0.01 s, but sample_time is 0.02 s"),
        ("  - 0.05\n", "", "half_extents are .*expected three numbers"),
        ("  - 0.05\n", "  - wide\n", "half_extents is 'wide', expected a number"),
        ("  - 0.05\n", "  - 0.5\n", "line 2: its lowest point is .* m under the support"),
    ],
)
def test_a_wrong_header_is_named(contact_folder, old, new, message):
    edit(contact_folder / "recording.yaml", (old, new))
    refused(contact_folder, message)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (",qw,", ",qv,", "unknown column 'qv'"),
        (",wz", ",wy", "two columns are called 'wy'"),
        ("\n0,0.01,", "\n0,0.0,", "line 3: time stands still"),
        ("\n0,0.05,", "\n0,0.055,", "line 7: a step of 0.015 s, expected uniform steps of 0.01 s"),
        ("\n0,0.05,", "\n0,0.05,nan,", "line 7: 16 values, expected 15"),
        ("\n0,0.05,", "\n0.5,0.05,", "line 7: episode is 0.5, expected a whole number"),
    ],
)
def test_a_wrong_table_is_named_by_its_line(contact_folder, old, new, message):
    edit(contact_folder / "contact.csv", (old, new))
    refused(contact_folder, message)


def rewritten(tmp_path, **changes):
    """A recording that is wrong in these arrays."""
    return write(dataclasses.replace(a_contact("velocity" in changes), **changes), tmp_path / "wrong")


def test_quaternions_that_are_none_bodies_under_the_plane_and_one_toss(tmp_path):
    one = a_contact()
    refused(rewritten(tmp_path / "a", attitude=0.5 * one.attitude), "line 2: .* norm of 0.5, expected a unit quat")
    refused(rewritten(tmp_path / "b", position=one.position - [0, 0, 0.2]), "m under the support, expected poses over")
    refused(rewritten(tmp_path / "c", position=1000 * one.position), "shape does not fit|no contact")
    refused(write(split(one, [0]), tmp_path / "d"), "one toss, expected at least 4 to hold some out")
    assert len(read(tmp_path / "d", hold_out=False)) == 1


def test_a_corner_that_is_round_may_come_down_lower_than_it_would_be(tmp_path):
    one = a_contact()
    round_edges = pack(NominalContact(0.37, 0.3, 0.2), {"corner_radius": {"value": 0.03}})[None]
    first = np.concatenate([one.position[:, 0], one.attitude[:, 0], one.velocity[:, 0]], axis=1)
    states = simulate(round_edges, one.shape, first, 60, 0.01)[0]
    assert one.shape.lowest(states[..., :3], states[..., 3:7]).min() < -0.25 * one.shape.depth
    rounded = dataclasses.replace(one, position=states[..., :3], attitude=states[..., 3:7], velocity=states[..., 7:])
    assert len(read(write(rounded, tmp_path / "round"))) == 4


def test_a_body_on_soft_springs_may_sink_for_a_moment(tmp_path):
    one = a_contact()
    soft = pack(NominalContact(0.37, 0.3, 0.2), {"contact_compliance": {"stiffness": 250.0, "damping": 4.0}})[None]
    first = np.concatenate([one.position[:, 0], one.attitude[:, 0], one.velocity[:, 0]], axis=1)
    states = simulate(soft, one.shape, first, 60, 0.01)[0]
    sinking = dataclasses.replace(one, position=states[..., :3], attitude=states[..., 3:7], velocity=states[..., 7:])
    assert (one.shape.lowest(states[..., :3], states[..., 3:7]) < -0.8 * one.shape.depth).any()
    assert len(read(write(sinking, tmp_path / "soft"))) == 4
    under = dataclasses.replace(sinking, position=sinking.position - [0, 0, 0.1])
    refused(write(under, tmp_path / "under"), "m under the support")


def test_no_contact_and_a_shape_that_does_not_fit(tmp_path):
    one = a_contact(False)
    fall = np.zeros_like(one.position)
    fall[..., 2] = 2.0 - 0.5 * 9.81 * (0.01 * np.arange(60)) ** 2
    flight = dataclasses.replace(one, position=fall)
    refused(write(flight, tmp_path / "flight"), "no contact in any episode, the body comes no nearer than 0")
    refused(rewritten(tmp_path, position=one.position + np.array([0, 0, 0.03])), "the shape does not fit the poses")


@pytest.mark.parametrize("spin", [0.0, 5.0])
def test_a_body_on_the_spot_is_read_though_its_poses_are_noisy(tmp_path, spin):
    rng = np.random.default_rng(0)
    one = a_contact()
    t = 0.005 * np.arange(100)
    position = np.array([0, 0, 0.05]) + rng.normal(0, 1.5e-4, (4, 100, 3))
    noise = Rotation.from_rotvec(rng.normal(0, 4e-3, (400, 3)))
    attitude = noise * Rotation.from_rotvec(np.tile(np.outer(spin * (t - 0.6 * t**2), [0, 0, 1]), (4, 1)))
    velocity = rng.normal(0, 1.5e-3, (4, 100, 6))
    velocity[..., 5] += spin * (1 - 1.2 * t)
    spinning = dataclasses.replace(
        one,
        **{"position": position, "attitude": attitude.as_quat().reshape(4, 100, 4), "velocity": velocity},
        **{"lengths": np.full(4, 100), "sample_time": 0.005},
    )
    assert len(read(write(spinning, tmp_path / "spun"))) == 4


def test_velocities_of_another_frame_unit_or_body_are_named(tmp_path):
    one = a_contact(samples=30)
    velocity, flat = one.velocity, Rotation.from_quat(one.attitude.reshape(-1, 4))
    body = np.concatenate([velocity[..., :3], flat.inv().apply(velocity[..., 3:].reshape(-1, 3)).reshape(4, 30, 3)], 2)
    for k, (wrong, message) in enumerate(
        [
            (body, "wx, wy, wz are in the body's frame"),
            (velocity * [1e3, 1e3, 1e3, 1, 1, 1], r"vx, vy, vz are \S+ times the derivative of position"),
            (velocity * [1, 1, 1, 57.3, 57.3, 57.3], r"wx, wy, wz are \S+ times the derivative of attitude"),
            (velocity[::-1], "do not follow position"),
        ]
    ):
        refused(write(dataclasses.replace(one, velocity=wrong), tmp_path / f"{k}"), message)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (TETRAHEDRON + "v 0.02 0.02 0.02\nf 2 3 5\nf 3 4 5\nf 4 2 5\n", "is not convex"),
        (TETRAHEDRON.replace("f 2 3 4\n", "v 0.02 0.02 0.02\nf 2 3 5\nf 3 4 5\nf 4 2 5\n"), "is not convex"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n", "enclose no volume"),
        ("v 0 0 0\n", "1 vertices, expected"),
        ("v 0 0 zero\n", "line 1: 'v 0 0 zero' is no vertex or face"),
    ],
)
def test_a_mesh_that_is_not_convex_or_none(tmp_path, content, message):
    folder = write(a_contact(), tmp_path / "mesh")
    header = folder / "recording.yaml"
    kept = [line for line in header.read_text().splitlines() if not line.startswith(("  half_extents", "  - "))]
    header.write_text("\n".join(kept).replace("shape: box", "shape: mesh\n  mesh: body.obj") + "\n")
    (folder / "body.obj").write_text(content)
    refused(folder, message)


def test_real_tosses_are_read_whole(tmp_path):
    recording = read_contactnets(TOSSES, 0.5, 0.5)
    assert len(recording) == 12 and recording.lengths.sum() == 1234
    read(write(recording, tmp_path / "tosses"))
    with pytest.raises(UserError, match="expected data and lengths"):
        read_contactnets(tmp_path / "tosses" / "contact.csv", 0.5, 0.5)
