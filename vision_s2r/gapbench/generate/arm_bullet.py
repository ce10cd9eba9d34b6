"""An arm under position servos, by PyBullet: bodies and dry friction are its own, the servo's law is written here.

No code is shared with the diagnosis.
"""

import tempfile
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vision_s2r.bullet import pybullet
from vision_s2r.gapbench.generate.arm_bodies import SWING, ArmBodies, simulated
from vision_s2r.gapbench.generate.arm_unknown import Torque

STEP = 1e-4  # s of the physics and the servo, at most; a torque that is held is half a step late
POSES = 40  # that loads on joints are measured in
GRAVITY = 9.81  # m/s²


@dataclass(frozen=True)
class Servo:
    """A joint's servo as it is."""

    proportional_gain: float  # N·m/rad
    torque_limit: float  # N·m
    viscous_damping: float  # N·m·s/rad
    coulomb_friction: float  # N·m
    delay: float = 0.0  # s
    deadband: float = 0.0  # rad
    velocity_limit: float = np.inf  # rad/s
    error_rate_gain: float = 0.0  # N·m·s/rad, on the rate of the error …
    error_filter: float = 0.01  # … filtered by this, s
    offset: float = 0.0  # rad, by which its encoder shows more
    unknown: Torque | None = None


@dataclass(frozen=True)
class Real:
    """An arm as it stands."""

    bodies: ArmBodies
    payload: tuple[float, ...] | None = None  # kg, and where on the tip, m
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)  # m/s², in the frame of its base
    table: float | None = None  # m: the height of a plane that its tip cannot go through


@dataclass(frozen=True)
class Loads:
    """What poses of an arm ask of its joints [J]."""

    inertia: np.ndarray  # kg·m², on the diagonal of the mass matrix at most
    coupled: np.ndarray  # kg·m², of the others' accelerations besides
    weight: np.ndarray  # N·m


@contextmanager
def _loaded(real: Real, offsets: Sequence[float] | None = None) -> Iterator[tuple[int, int, list[int]]]:
    """A client, the arm in it, and its driven joints, where encoders show home, without the engine's own damping."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(*real.gravity, physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "arm.urdf"
            path.write_text(simulated(real.bodies, real.payload, touches=real.table is not None))
            flags = pybullet.URDF_USE_INERTIA_FROM_FILE
            body = pybullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=client)
        if real.table is not None:
            plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
            pybullet.createMultiBody(0, plane, basePosition=[0, 0, real.table], physicsClientId=client)
        count = pybullet.getNumJoints(body, physicsClientId=client)
        names = {pybullet.getJointInfo(body, k, physicsClientId=client)[1].decode(): k for k in range(count)}
        for k in range(-1, count):
            pybullet.changeDynamics(
                body, k, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client
            )  # fmt: skip
        joints = [names[name] for name in real.bodies.joints]
        for j, home, more in zip(joints, real.bodies.home, offsets or [0.0] * len(joints), strict=True):
            pybullet.resetJointState(body, j, home - more, physicsClientId=client)
        yield client, body, joints
    finally:
        pybullet.disconnect(physicsClientId=client)


def loads(real: Real, rng: np.random.Generator) -> Loads:
    """Of poses about the arm's home."""
    home, masses, weights = np.array(real.bodies.home), [], []
    with _loaded(real) as (client, body, _):
        for _ in range(POSES):
            pose = list(home + rng.uniform(-SWING, SWING, len(home)))
            still = [0.0] * len(home)
            masses.append(np.array(pybullet.calculateMassMatrix(body, pose, physicsClientId=client)))
            weights.append(pybullet.calculateInverseDynamics(body, pose, still, still, physicsClientId=client))
    largest = np.abs(masses).max(axis=0)
    own = np.diagonal(largest).copy()
    return Loads(own, largest.sum(axis=1) - own, np.abs(weights).max(axis=0))


def weight_by_joint(bodies: ArmBodies) -> np.ndarray:
    """What a turn of each joint [J] from home changes at most in the weight on any of them, N·m/rad."""
    turn, still = 0.1, [0.0] * len(bodies.home)
    with _loaded(Real(bodies)) as (client, body, _):
        weights = [
            np.array(pybullet.calculateInverseDynamics(body, list(pose), still, still, physicsClientId=client))
            for pose in (bodies.home, *(np.array(bodies.home) + turn * np.eye(len(still))))
        ]
    return np.abs(np.array(weights[1:]) - weights[0]).max(axis=1) / turn


def tip_heights(bodies: ArmBodies, positions: np.ndarray) -> np.ndarray:
    """How high the tip is [N] (m) in poses [N, J]."""
    found = []
    with _loaded(Real(bodies)) as (client, body, joints):
        for pose in positions:
            for j, position in zip(joints, pose, strict=True):
                pybullet.resetJointState(body, j, position, physicsClientId=client)
            state = pybullet.getLinkState(body, joints[-1], computeForwardKinematics=True, physicsClientId=client)
            found.append(state[4][2])
    return np.array(found)


def run(real: Real, servos: Sequence[Servo], commands: np.ndarray, rate: float) -> np.ndarray:
    """Positions [T, J] (rad) at `rate` Hz of an arm that starts at rest at home and is told `commands` [T, J]."""
    inner = int(np.ceil(1 / rate / STEP - 1e-9))
    step = 1 / rate / inner
    with _loaded(real, [servo.offset for servo in servos]) as (client, body, joints):
        pybullet.setTimeStep(step, physicsClientId=client)
        for j, servo in zip(joints, servos, strict=True):
            pybullet.setJointMotorControl2(
                body, j, pybullet.VELOCITY_CONTROL, targetVelocity=0, force=servo.coulomb_friction,
                physicsClientId=client,
            )  # fmt: skip
        return _stepped(client, body, joints, servos, real.bodies.home, commands, inner, step)


def _stepped(
    client: int,
    body: int,
    joints: list[int],
    servos: Sequence[Servo],
    home: Sequence[float],
    commands: np.ndarray,
    inner: int,
    step: float,
) -> np.ndarray:
    sent = [deque([at] * round(servo.delay / step)) for servo, at in zip(servos, home, strict=True)]
    points, last, filtered = list(home), [0.0] * len(servos), [0.0] * len(servos)
    out, count = np.empty(commands.shape), 0
    for k, command in enumerate(commands.tolist()):
        # A force acts half a step to either side of the position that it is given at: rows are half a step back.
        rows = pybullet.getJointStates(body, joints, physicsClientId=client)
        out[k] = [
            position - 0.5 * step * velocity + servo.offset
            for servo, (position, velocity, *_) in zip(servos, rows, strict=True)
        ]
        for _ in range(inner):
            states = pybullet.getJointStates(body, joints, physicsClientId=client)
            forces = []
            for j, servo in enumerate(servos):
                position, newest = states[j][0] + servo.offset, states[j][1]
                sent[j].append(command[j])
                asked = sent[j].popleft()
                fastest = servo.velocity_limit * step
                before = points[j]
                points[j] += min(max(asked - before, -fastest), fastest)
                point = points[j] if fastest == np.inf else 0.5 * (before + points[j])
                error = point - position
                beyond = max(abs(error) - servo.deadband / 2, 0.0)
                force = servo.proportional_gain * (beyond if error > 0 else -beyond)
                rate = (error - filtered[j]) / servo.error_filter
                filtered[j] += step * rate
                force += servo.error_rate_gain * rate
                force = min(max(force, -servo.torque_limit), servo.torque_limit)
                # The engine's velocities are those in the middle of its last step: half a step on, they are these.
                velocity, last[j] = 1.5 * newest - 0.5 * last[j], newest
                if servo.unknown is not None:
                    places = np.array([each[0] for each in states]) - home
                    force += servo.unknown(count * step, places, velocity, force)
                forces.append(force - servo.viscous_damping * velocity)
            pybullet.setJointMotorControlArray(
                body, joints, pybullet.TORQUE_CONTROL, forces=forces, physicsClientId=client
            )  # fmt: skip
            pybullet.stepSimulation(physicsClientId=client)
            count += 1
    return out
