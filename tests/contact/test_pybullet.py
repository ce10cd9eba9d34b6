"""The same bodies in PyBullet, at a fine step: another solver, another integrator, the same laws.

Without rebounds: at a fine step PyBullet loses most of a restitution in its margin before contact. What
differs later is that small errors grow with every impact.
"""

import json

import numpy as np
import pybullet
import pytest

from vision_s2r.contact import NominalContact, benchmark, box, cylinder, pack, simulate, sphere

BODY = NominalContact(benchmark.BODY.mass, benchmark.BODY.lateral_friction, 0.0)
STEP, EVERY, SAMPLES = 1e-4, 50, 41  # s; steps a sample, samples
SHAPES = {"cube": box((0.0524,) * 3), "ball": sphere(0.05), "cylinder": cylinder(0.04, 0.08)}


def collision(client, shape):
    if shape == "cube":
        return pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.0524] * 3, physicsClientId=client)
    if shape == "ball":
        return pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=0.05, physicsClientId=client)
    return pybullet.createCollisionShape(pybullet.GEOM_CYLINDER, radius=0.04, height=0.08, physicsClientId=client)


def in_pybullet(shape, first, changes):
    """Positions [W, T, 3]."""
    client = pybullet.connect(pybullet.DIRECT)
    body = benchmark.pybullet_body(client, collision(client, shape), STEP, **{"restitution": 0.0, **changes})
    out = np.empty((len(first), SAMPLES, 3))
    for w, state in enumerate(first):
        benchmark.pybullet_place(client, body, state)
        for k in range(SAMPLES):
            out[w, k] = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0]
            for _ in range(EVERY):
                pybullet.stepSimulation(physicsClientId=client)
    pybullet.disconnect(client)
    return out


@pytest.mark.parametrize(
    ("shape", "effects", "changes", "within"),  # mm, of the median body 0.2 s on
    [
        ("cube", {}, {}, 0.5),
        ("cylinder", {}, {}, 0.5),
        ("cube", {"lateral_friction": {"value": 0.5}}, {"lateralFriction": 0.5}, 0.5),
        ("cube", {"spinning_friction": {"value": 0.01}}, {"spinningFriction": 0.01}, 0.5),
        ("cube", {"rolling_friction": {"value": 0.01}}, {"rollingFriction": 0.01}, 0.5),
        ("ball", {"rolling_friction": {"value": 0.003}}, {"rollingFriction": 0.003}, 0.1),
        (
            "cube",
            {"contact_compliance": {"stiffness": 2e4, "damping": 10.0}},
            {"contactStiffness": 2e4, "contactDamping": 10.0},
            2.5,
        ),
    ],
)
def test_the_same_motion_as_pybullets(shape, effects, changes, within):
    first = benchmark.toss(12, 0)
    if shape == "ball":  # it rolls
        first[:, 2], first[:, 9] = 0.05, 0.0
    ours, plain = (
        simulate(pack(BODY, each)[None], SHAPES[shape], first, SAMPLES, STEP * EVERY, substeps=10)[0, :, :, :3]
        for each in (effects, {})
    )
    theirs = in_pybullet(shape, first, changes)
    error, without = (1e3 * np.median(np.linalg.norm(x - theirs, axis=-1)[:, -1]) for x in (ours, plain))
    assert error < within and (not effects or without > 3 * error)


def test_the_benchmark_measures_all_ways(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(benchmark, "ROUNDS", 1)
    table = json.loads(benchmark.run(0, tmp_path).read_text())  # as the documentation's tables are
    speeds = {row[0]: row[1] for row in table["rows"]}
    assert speeds[benchmark.BATCHED] > speeds[benchmark.REFERENCE] > 0
    assert benchmark.REFERENCE in capsys.readouterr().out
