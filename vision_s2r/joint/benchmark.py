"""How fast joints are simulated, against the loops that everybody writes first.

All ways step the same joint by 2 ms under the same commands, in turns in one process, so that they share the machine's
moods; what counts is their ratio. A step is one integration step of one joint.
"""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.progress import track

from vision_s2r.bullet import pybullet
from vision_s2r.joint.machine import NominalJoint, pack
from vision_s2r.joint.simulation import simulate
from vision_s2r.results import publish

JOINT = NominalJoint(torque_constant=0.5, inertia=0.02, viscous_damping=0.1, coulomb_friction=0.02)
SAMPLE_TIME = 0.01
SUBSTEPS = 5
EPISODES, SAMPLES = 5, 800
CANDIDATES = 64
LOOP_SAMPLES = 200  # of the slow loops
ROUNDS = 7

EFFECTS: dict[str, dict[str, dict[str, float]]] = {
    "ours, one mass": {},
    "ours, with gravity, cogging and Stribeck friction": {
        "gravity_torque": {"value": 0.1},
        "cogging": {"amplitude": 0.05, "teeth": 12.0},
        "stribeck_friction": {"static": 0.05, "velocity": 0.2},
    },
    "ours, two masses with play": {"backlash": {"width": 0.03}},
    "ours, two masses on a spring": {"compliance": {"stiffness": 5.0, "damping": 0.01}},
}
REFERENCES = ("NumPy loop, all episodes at once", "NumPy loop, all candidates at once", "PyBullet loop")


def run(seed: int, out: Path) -> Path:
    """Measure steps a second of each way, medians over rounds; print and write joint.json, whose path it returns."""
    levels = np.random.default_rng(seed).uniform(-1.8, 1.8, (EPISODES, SAMPLES // 20))
    command = np.repeat(levels, 20, axis=1)
    ways: dict[str, Callable[[], float]] = {name: _ours(effects, command) for name, effects in EFFECTS.items()}
    ways[REFERENCES[0]] = lambda: _numpy(command[:, :LOOP_SAMPLES])
    ways[REFERENCES[1]] = lambda: _numpy(np.tile(command[:, :LOOP_SAMPLES], (CANDIDATES, 1)))
    ways[REFERENCES[2]] = lambda: _pybullet(command[0, :LOOP_SAMPLES])
    for way in ways.values():
        way()  # compiles, loads
    rounds = [{name: way() for name, way in ways.items()} for _ in track(range(ROUNDS), "rounds")]
    speeds = {name: float(np.median([speed[name] for speed in rounds])) for name in ways}
    columns = [
        "way",
        "million steps/s",
        f"ms for {EPISODES} × {SAMPLES} samples",
        *(f"/ {each}" for each in REFERENCES),
    ]
    log = {name: EPISODES * SAMPLES * SUBSTEPS / speed * 1e3 for name, speed in speeds.items()}
    rows = [[n, s / 1e6, log[n], *(s / speeds[reference] for reference in REFERENCES)] for n, s in speeds.items()]
    return publish(out / "joint.json", "vision-s2r benchmark joint", columns, rows)


def _ours(effects: dict[str, dict[str, float]], command: np.ndarray) -> Callable[[], float]:
    machines = np.repeat(pack(JOINT, effects)[None], CANDIDATES, axis=0)
    first = np.zeros((EPISODES, 2))

    def way() -> float:
        start = time.perf_counter()
        simulate(machines, command, first, SAMPLE_TIME, substeps=SUBSTEPS)
        return CANDIDATES * command.size * SUBSTEPS / (time.perf_counter() - start)

    return way


def _numpy(command: np.ndarray) -> float:
    """The plain loop: semi-implicit Euler on arrays over episodes, friction clamped to what stops the joint."""
    joints, samples = command.shape
    step = SAMPLE_TIME / SUBSTEPS
    position, velocity = np.zeros(joints), np.zeros(joints)
    log = np.empty((samples, joints, 2))
    start = time.perf_counter()
    for k in range(samples):
        log[k, :, 0], log[k, :, 1] = position, velocity
        for _ in range(SUBSTEPS):
            torque = JOINT.torque_constant * command[:, k] - JOINT.viscous_damping * velocity
            velocity = velocity + step * torque / JOINT.inertia
            friction = step * JOINT.coulomb_friction / JOINT.inertia
            velocity = velocity - np.clip(velocity, -friction, friction)
            position = position + step * velocity
    return joints * samples * SUBSTEPS / (time.perf_counter() - start)


def _pybullet(command: np.ndarray) -> float:
    """One joint under torque control, its dry friction a motor that brakes to 0 with little force."""
    client = pybullet.connect(pybullet.DIRECT)
    body = pybullet_joint(client, SAMPLE_TIME / SUBSTEPS)
    log = np.empty((len(command), 2))
    start = time.perf_counter()
    for k, current in enumerate(command):
        log[k] = pybullet.getJointState(body, 0, physicsClientId=client)[:2]
        for _ in range(SUBSTEPS):
            torque = JOINT.torque_constant * current
            pybullet.setJointMotorControl2(body, 0, pybullet.TORQUE_CONTROL, force=torque, physicsClientId=client)
            pybullet.stepSimulation(physicsClientId=client)
    elapsed = time.perf_counter() - start
    pybullet.disconnect(physicsClientId=client)
    return len(command) * SUBSTEPS / elapsed


def pybullet_joint(client: int, step: float) -> int:
    """The same joint in PyBullet: a revolute link about z on a fixed base; the body's id."""
    pybullet.setTimeStep(step, physicsClientId=client)
    pybullet.setGravity(0, 0, 0, physicsClientId=client)
    body = pybullet.createMultiBody(
        baseMass=0,
        linkMasses=[1.0],
        linkCollisionShapeIndices=[-1],
        linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]],
        linkOrientations=[[0, 0, 0, 1]],
        linkInertialFramePositions=[[0, 0, 0]],
        linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkParentIndices=[0],
        linkJointTypes=[pybullet.JOINT_REVOLUTE],
        linkJointAxis=[[0, 0, 1]],
        physicsClientId=client,
    )
    pybullet.changeDynamics(
        body,
        0,
        localInertiaDiagonal=[JOINT.inertia] * 3,
        jointDamping=JOINT.viscous_damping,
        linearDamping=0,
        angularDamping=0,
        physicsClientId=client,
    )
    pybullet.setJointMotorControl2(
        body, 0, pybullet.VELOCITY_CONTROL, targetVelocity=0, force=JOINT.coulomb_friction, physicsClientId=client
    )
    return body
