"""How fast bodies are simulated, against PyBullet's steps of the same body.

All ways toss the same body by the same steps, in turns in one process and on one thread each, so that they share the
machine's moods; seconds are the processor's, to which others that wait for it add nothing. What counts is the ratio. A
step is one integration step of one body near its support; far from it, and at rest, a body needs fewer, which the
figures of a whole toss include and those of sliding do not. A turn is ten logs one after the other, as a fit goes
through many, so that what another way has left in the caches is no part of it.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.progress import track

from vision_s2r.bullet import pybullet
from vision_s2r.contact.machine import NominalContact, pack
from vision_s2r.contact.shape import Shape, box, cylinder, sphere
from vision_s2r.contact.simulate import STATE, simulate
from vision_s2r.results import publish

BODY = NominalContact(mass=0.37, lateral_friction=0.2, restitution=0.15)
SAMPLE_TIME, SUBSTEPS, SAMPLES = 0.0068, 5, 104
LOGS, TOSSES, MACHINES = 10, 24, 8
WATCHED = 4  # tosses of a log that PyBullet's turn takes
APART = 0.02  # of their friction, by which machines differ, as those of a fit or of a posterior do
ROUNDS = 9

CUBE, BRICK, BALL, ROLLER = box((0.0524,) * 3), box((0.06, 0.04, 0.03)), sphere(0.05), cylinder(0.04, 0.08)
COMPLIANT = {"contact_compliance": {"stiffness": 2e4, "damping": 10.0}}
REFERENCE, BATCHED = "PyBullet, tosses of a cube", "ours, tosses of a cube by eight machines"


def run(seed: int, out: Path) -> Path:
    """Measure steps a second of each way, medians over rounds; print and write contact.json, whose path it returns."""
    tosses = toss(LOGS * TOSSES, seed).reshape(LOGS, TOSSES, STATE)
    slides = np.tile(_slides(TOSSES), (LOGS, 1, 1))
    ways: dict[str, Callable[[], float]] = {
        BATCHED: lambda: _ours(CUBE, tosses),
        "ours, of one machine alone": lambda: _ours(CUBE, tosses, machines=1),
        "ours, tosses of a brick": lambda: _ours(BRICK, tosses),
        "ours, tosses of a ball": lambda: _ours(BALL, tosses),
        "ours, tosses of a cylinder": lambda: _ours(ROLLER, tosses),
        "ours, a compliant cube": lambda: _ours(CUBE, tosses, COMPLIANT),
        "ours, a sliding cube": lambda: _ours(CUBE, slides),
        REFERENCE: lambda: _pybullet(tosses[:, :WATCHED]),
        "PyBullet, a sliding cube": lambda: _pybullet(slides[:, :WATCHED]),
    }
    for way in ways.values():
        way()  # compiles, loads
    rounds = [{name: way() for name, way in ways.items()} for _ in track(range(ROUNDS), "rounds")]
    speeds = {name: float(np.median([speed[name] for speed in rounds])) for name in ways}
    ratios = {name: float(np.median([speed[name] / speed[REFERENCE] for speed in rounds])) for name in ways}
    columns = ["way", "million steps/s", f"ms for {TOSSES} × {SAMPLES} samples", f"/ {REFERENCE}"]
    log = {name: TOSSES * (SAMPLES - 1) * SUBSTEPS / speed * 1e3 for name, speed in speeds.items()}
    rows = [[name, speed / 1e6, log[name], ratios[name]] for name, speed in speeds.items()]
    return publish(out / "contact.json", "vision-s2r benchmark contact", columns, rows)


def toss(count: int, seed: int) -> np.ndarray:
    """First states [count, 13] of a body of 10 cm that is thrown at its support with a spin."""
    rng = np.random.default_rng(seed)
    first = np.zeros((count, STATE))
    first[:, 2] = rng.uniform(0.12, 0.25, count)
    attitude = rng.normal(size=(count, 4))
    first[:, 3:7] = attitude / np.linalg.norm(attitude, axis=1, keepdims=True)
    first[:, 7:10] = rng.normal(size=(count, 3)) * (1.0, 1.0, 0.3)
    first[:, 10:] = rng.normal(0, 5, (count, 3))
    return first


def _slides(count: int) -> np.ndarray:
    """A cube that slides on a face, turning."""
    first = np.zeros((count, STATE))
    first[:, 2], first[:, 6], first[:, 7], first[:, 12] = 0.0524, 1.0, 2.0, np.linspace(-5, 5, count)
    return first


def _ours(
    shape: Shape,
    logs: np.ndarray,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    machines: int = MACHINES,
) -> float:
    frictions = BODY.lateral_friction * np.linspace(1 - APART, 1 + APART, machines)
    packed = np.stack([pack(replace(BODY, lateral_friction=each), effects or {}) for each in frictions])
    start = time.process_time()
    for first in logs:
        simulate(packed, shape, first, SAMPLES, SAMPLE_TIME, substeps=SUBSTEPS, threads=1)
    return machines * logs[..., 0].size * (SAMPLES - 1) * SUBSTEPS / (time.process_time() - start)


def _pybullet(logs: np.ndarray) -> float:
    """The loop that everybody writes: step, and at each sample read pose and velocity."""
    client = pybullet.connect(pybullet.DIRECT)
    cube = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.0524] * 3, physicsClientId=client)
    body = pybullet_body(client, cube, SAMPLE_TIME / SUBSTEPS)
    elapsed = 0.0
    starts = logs.reshape(-1, STATE)
    for state in starts:
        pybullet_place(client, body, state)
        start = time.process_time()
        for _ in range(SAMPLES - 1):
            for _ in range(SUBSTEPS):
                pybullet.stepSimulation(physicsClientId=client)
            pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
            pybullet.getBaseVelocity(body, physicsClientId=client)
        elapsed += time.process_time() - start
    pybullet.disconnect(physicsClientId=client)
    return len(starts) * (SAMPLES - 1) * SUBSTEPS / elapsed


def pybullet_body(client: int, shape: int, step: float, **changes: float) -> int:
    """The same body on a plane in PyBullet; `changes` are changeDynamics's own. The body's id.

    Coefficients are products there: the plane's are 1. Rebounds have no threshold, as ours have next to none.
    """
    pybullet.setTimeStep(step, physicsClientId=client)
    pybullet.setGravity(0, 0, -BODY.gravity, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(restitutionVelocityThreshold=0.02, physicsClientId=client)
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    support = pybullet.createMultiBody(0, plane, physicsClientId=client)
    pybullet.changeDynamics(support, -1, lateralFriction=1, restitution=1, physicsClientId=client)
    body = int(pybullet.createMultiBody(BODY.mass, shape, physicsClientId=client))
    coefficients = {"lateralFriction": BODY.lateral_friction, "restitution": BODY.restitution}
    plain = {"linearDamping": 0.0, "angularDamping": 0.0}
    pybullet.changeDynamics(body, -1, physicsClientId=client, **{**coefficients, **plain, **changes})
    return body


def pybullet_place(client: int, body: int, state: np.ndarray) -> None:
    """Give the body a state [13]."""
    pybullet.resetBasePositionAndOrientation(body, state[:3].tolist(), state[3:7].tolist(), physicsClientId=client)
    pybullet.resetBaseVelocity(body, state[7:10].tolist(), state[10:].tolist(), physicsClientId=client)
