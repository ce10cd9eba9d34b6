"""Generated tosses: an integrator of its own that agrees with the laws of the vocabulary; recordings that are read."""

from dataclasses import asdict

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vision_s2r.contact import NominalContact, box, pack, simulate
from vision_s2r.contact.benchmark import toss
from vision_s2r.fit.contact import experiments
from vision_s2r.gapbench.generate import contact
from vision_s2r.gapbench.generate.body import FINE, TossedBody, move
from vision_s2r.recording import read

CUBE = box((0.05, 0.05, 0.05))


@pytest.mark.parametrize(
    ("fields", "effects"),
    [
        ({}, {}),
        ({"friction": 0.15}, {"lateral_friction": {"value": 0.15}}),
        ({"spinning": 0.02}, {"spinning_friction": {"value": 0.02}}),
        ({"rolling": 0.01}, {"rolling_friction": {"value": 0.01}}),
        ({"center_x": 0.006, "center_z": -0.005}, {"center_of_mass": {"x": 0.006, "y": 0.0, "z": -0.005}}),
        ({"rounding": 0.008}, {"corner_radius": {"value": 0.008}}),
        ({"roll": 0.05, "pitch": -0.03}, {"support_tilt": {"roll": 0.05, "pitch": -0.03}}),
        ({"stiffness": 1e4, "damping": 8.0}, {"contact_compliance": {"stiffness": 1e4, "damping": 8.0}}),
    ],
)
def test_two_integrators_that_share_no_code_move_bodies_alike(fields, effects):
    first, samples, step = toss(5, 4), 50, 0.006
    body = TossedBody(0.37, 0.4, 0.2)._replace(**fields)
    theirs = np.stack([move(body, CUBE.points, 0.0, CUBE.inertia, row, samples, step, FINE) for row in first])
    machine = pack(NominalContact(0.37, 0.4, 0.2), effects)[None]
    ours = simulate(machine, CUBE, first, samples, step, substeps=20)[0]
    bare = simulate(pack(NominalContact(0.37, 0.4, 0.2), {})[None], CUBE, first, samples, step, substeps=20)[0]
    error, without = (np.median(np.linalg.norm((x - theirs)[:, -1, :3], axis=-1)) for x in (ours, bare))
    assert error < 2e-3 and (not effects or without > 1.5 * error)


def test_torques_of_an_impact_leave_newtons_law_at_the_point_that_hits():
    attitude = Rotation.from_euler("xyz", (0.5, 0.4, 0.3))
    lowest = min(attitude.apply(CUBE.points), key=lambda point: point[2])
    first = np.concatenate([[0, 0, 5e-5 - lowest[2]], attitude.as_quat(), [0.6, -0.3, -1.5], [4, -3, 5]])
    effects = {"rolling_friction": {"value": 0.01}, "spinning_friction": {"value": 0.01}}
    body = TossedBody(0.37, 0.4, 0.2, 1e-9, rolling=0.01, spinning=0.01)
    theirs = move(body, CUBE.points, 0.0, CUBE.inertia, first, 4, FINE, FINE)[-1]
    ours = simulate(pack(NominalContact(0.37, 0.4, 0.2, 1e-9), effects)[None], CUBE, first[None], 4, FINE)[0, 0, -1]
    approach = (first[7:10] + np.cross(first[10:], lowest))[2]
    for after in (ours, theirs):
        assert (after[7:10] + np.cross(after[10:], lowest))[2] == pytest.approx(-0.2 * approach, rel=0.03)
    assert ours[7:] == pytest.approx(theirs[7:], abs=0.15)


def test_a_generated_recording_is_read_and_drawn_again_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(contact, "TOSSES", 4)
    for name in ("a", "b"):
        machine = contact.machine("null", 0, "tuning", np.random.default_rng(3))
        (tmp_path / name).mkdir()
        machine.write(tmp_path / name)
    one, two = ((tmp_path / name / "contact.csv").read_text() for name in ("a", "b"))
    assert one == two and machine.answer.effects == {} and machine.answer.severity == 0
    assert len(read(tmp_path / "a")) == contact.TOSSES


def test_a_body_is_tossed_once_more_as_a_report_asks(tmp_path, monkeypatch):
    monkeypatch.setattr(contact, "TOSSES", 4)
    machine = contact.machine("null", 0, "tuning", np.random.default_rng(3))
    (tmp_path / "before").mkdir()
    machine.write(tmp_path / "before")
    before, answer = read(tmp_path / "before"), asdict(machine.answer)
    high = np.array([[0.1 * k, 0, 1.5, 0, 0, 0, 1, 0.5, 0, 1, 0, 0, 0] for k in range(2)])
    columns = dict(zip(contact.COLUMNS, high.T, strict=True))
    rows = [",".join(columns), *(",".join(map(repr, row.tolist())) for row in high)]
    (tmp_path / "next_recording.csv").write_text("\n".join(rows) + "\n")
    throws = contact.asked(tmp_path, tmp_path / "before", answer)
    contact.continued(tmp_path / "before", tmp_path / "after", answer, throws, np.random.default_rng(1))
    after = read(tmp_path / "after")
    assert len(after) == len(before) + 2
    assert np.array_equal(after.position[:4, : before.position.shape[1]], before.position, equal_nan=True)
    t = np.arange(after.lengths[-1]) * after.sample_time
    assert t[-1] == pytest.approx(experiments.SECONDS, abs=0.02)
    flies = t < 0.4  # s, until which it meets nothing
    height = 1.5 + t - 9.81 * t**2 / 2
    for k, throw in enumerate(after.position[-2:]):
        assert throw[: len(t)][flies, 2] == pytest.approx(height[flies], abs=5e-3)
        assert throw[: len(t)][flies, 0] == pytest.approx(0.1 * k + 0.5 * t[flies], abs=5e-3)
    assert contact.at_random(tmp_path / "before", answer, throws, np.random.default_rng(2)).shape == throws.shape
