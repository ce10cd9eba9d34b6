"""Generated arms, by PyBullet: chains of links that are drawn, servos of its own at 10 kHz, logs at 100 Hz.

Rigid bodies and dry friction are PyBullet's; the servo's law, with what it lacks, is written out here. No code is
shared with the diagnosis.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vision_s2r.bullet import pybullet
from vision_s2r.gapbench.generate.arm_unknown import UNKNOWN, Torque
from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine

CASES = ("null", "single", "pair", "unknown")
# s of the physics and the servo, Hz of the log; a torque that is held is half a step late
STEP, RATE = 1e-4, 100.0
EPISODES, SECONDS = 4, 8.0
NOISE = 2e-4  # rad
RADIUS = 0.03  # m, of links
SECOND = ("latency", "proportional_gain", "torque_saturation", "viscous_damping", "deadband", "coulomb_friction")
FIRST = (*SECOND, "payload", "velocity_limit")


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
    unknown: Torque | None = None


@dataclass(frozen=True)
class Chain:
    """Links of steel rod on a stand: lengths (m), masses (kg), and axes of the joints at their beginnings."""

    lengths: tuple[float, ...]
    masses: tuple[float, ...]
    axes: tuple[str, ...]
    payload: tuple[float, float, float, float] | None = None  # kg, and where on the last link, m


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """An arm of two or three joints; cases take the effects in turn, `unknown` those of its split."""
    chain, drives = _drawn(rng)
    joints = rng.permutation(len(drives))
    effects: Effects = {}
    real, truth = chain, list(drives)
    unknown = None
    if case == "unknown":
        unknown, family = list(UNKNOWN[split].items())[index % len(UNKNOWN[split])]
        at = joints[0]
        truth[at] = replace(truth[at], unknown=family(at, len(drives), truth[at].proportional_gain, rng))
    names = {"null": (), "unknown": (), "single": (FIRST[index % len(FIRST)],)}.get(case)
    if names is None:
        pairs = [(a, b) for a in SECOND for b in SECOND if a != b]
        names = pairs[(7 * index) % len(pairs)]
    for name, joint in zip(names, joints, strict=False):
        if name == "payload":
            mass = rng.uniform(0.15, 0.5) * chain.masses[-1]
            place = (float(rng.uniform(0.5, 1.0) * chain.lengths[-1]), 0.0, 0.0)
            real = replace(chain, payload=(float(mass), *place))
            effects[name] = dict(zip(("mass", "x", "y", "z"), (float(mass), *place), strict=True))
        else:
            truth[joint], parameters = _with(name, truth[joint], rng)
            effects[f"joint{joint}.{name}"] = parameters
    notes = {"masses": list(chain.masses), "lengths": list(chain.lengths)}
    answer = Answer(case, effects, unknown=unknown, notes=notes)
    log = _log(real, truth, rng)
    return GeneratedMachine(answer, lambda folder: _write(folder, chain, drives, log))


def _drawn(rng: np.random.Generator) -> tuple[Chain, list[Servo]]:
    """An arm and its servos, strong enough to carry it."""
    count = int(rng.integers(2, 4))
    lengths = rng.uniform(0.15, 0.3, count)
    masses = rng.uniform(0.2, 0.6, count) * np.linspace(1.3, 0.7, count)
    axes = ("y", *rng.choice(["y", "y", "z"], count - 1))
    chain = Chain(tuple(map(float, lengths)), tuple(map(float, masses)), tuple(map(str, axes)))
    drives = []
    for k in range(count):
        reach = np.cumsum(lengths[k:]) - lengths[k:] / 2
        weight = 9.81 * float(masses[k:] @ reach)
        inertia = float(masses[k:] @ reach**2) + 0.002
        gain = float(inertia * rng.uniform(15, 25) ** 2 + 4 * weight)
        damping = float(2 * rng.uniform(0.4, 0.8) * np.sqrt(gain * inertia))
        drives.append(Servo(gain, float(2.5 * weight + 0.35 * gain), damping, float(0.04 * weight + 0.005 * gain)))
    return chain, drives


def _with(name: str, drive: Servo, rng: np.random.Generator) -> tuple[Servo, dict[str, float]]:
    """A servo with an effect that shows, and the effect's parameters."""
    up = float(rng.uniform(1.3, 1.7))
    value: float
    if name in ("proportional_gain", "viscous_damping", "coulomb_friction"):
        value = getattr(drive, name) * (up if rng.random() < 0.5 else 1 / up)
        if name == "coulomb_friction":
            value = drive.coulomb_friction * float(rng.uniform(2, 3))
        changed: dict[str, Any] = {name: value}
        return replace(drive, **changed), {"value": value}
    if name == "latency":
        value = float(rng.uniform(0.008, 0.03))
        return replace(drive, delay=value), {"delay": value}
    if name == "deadband":
        value = float(rng.uniform(0.02, 0.05))
        return replace(drive, deadband=value), {"width": value}
    if name == "velocity_limit":
        value = float(rng.uniform(0.8, 1.6))
        return replace(drive, velocity_limit=value), {"value": value}
    value = drive.torque_limit * float(rng.uniform(0.35, 0.5))
    return replace(drive, torque_limit=value), {"limit": value}


# The simulation


def _urdf(chain: Chain) -> str:
    """A URDF of the chain."""
    inertia = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    parts = ['<robot name="chain">', f'<link name="stand"><inertial><mass value="1"/>{inertia}</inertial></link>']
    parent, at = "stand", "0 0 0"
    for k, (length, mass, axis) in enumerate(zip(chain.lengths, chain.masses, chain.axes, strict=True)):
        across, along = mass * (3 * RADIUS**2 + length**2) / 12, mass * RADIUS**2 / 2
        parts += [
            f'<link name="link{k}"><inertial><origin xyz="{length / 2!r} 0 0"/><mass value="{mass!r}"/>',
            f'<inertia ixx="{along!r}" iyy="{across!r}" izz="{across!r}" ixy="0" ixz="0" iyz="0"/></inertial></link>',
            f'<joint name="joint{k}" type="continuous"><parent link="{parent}"/><child link="link{k}"/>',
            f'<origin xyz="{at}"/><axis xyz="{"0 1 0" if axis == "y" else "0 0 1"}"/></joint>',
        ]
        parent, at = f"link{k}", f"{length!r} 0 0"
    return "\n".join([*parts, "</robot>"]) + "\n"


def _load(client: int, chain: Chain, folder: Path) -> int:
    path = folder / "chain.urdf"
    text = _urdf(chain)
    if chain.payload is not None:
        mass, x, y, z = chain.payload
        tip = f"link{len(chain.lengths) - 1}"
        text = text.replace(
            "</robot>",
            f'<link name="payload"><inertial><mass value="{mass!r}"/><inertia ixx="1e-9" iyy="1e-9" izz="1e-9" ixy="0" '
            f'ixz="0" iyz="0"/></inertial></link><joint name="fixed" type="fixed"><parent link="{tip}"/>'
            f'<child link="payload"/><origin xyz="{x!r} {y!r} {z!r}"/></joint></robot>',
        )
    path.write_text(text)
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    body: int = pybullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=client)
    return body


def _log(chain: Chain, drives: list[Servo], rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The log: episode, t, and of each joint command and position."""
    columns: dict[str, list[np.ndarray]] = {}
    rows = round(SECONDS * RATE)
    t = np.arange(rows) / RATE
    for episode in range(EPISODES):
        commands = np.stack([_motion(t, rng) for _ in drives], axis=1)
        positions = _run(chain, drives, commands)
        found = {"episode": np.full(rows, episode), "t": t}
        for j in range(len(drives)):
            found |= {f"command.joint{j}": commands[:, j]}
            found |= {f"position.joint{j}": positions[:, j] + NOISE * rng.standard_normal(rows)}
        for name, values in found.items():
            columns.setdefault(name, []).append(values)
    return {name: np.concatenate(values) for name, values in columns.items()}


def _motion(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sines and steps, which begin where the arm hangs."""
    slow, fast = rng.uniform(1.0, 2.5), rng.uniform(3.0, 8.0)
    sines = 0.5 * np.sin(slow * t) + 0.15 * np.sin(fast * t)
    levels = rng.uniform(-0.25, 0.25, 40)
    levels[0] = 0.0
    return np.asarray(sines + levels[(t / rng.uniform(0.5, 1.0)).astype(int)])


def _run(chain: Chain, drives: list[Servo], commands: np.ndarray) -> np.ndarray:
    """Positions [T, J] (rad) of an arm that starts at rest at 0 and is told `commands` [T, J]."""
    import tempfile

    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
        pybullet.setTimeStep(STEP, physicsClientId=client)
        with tempfile.TemporaryDirectory() as folder:
            body = _load(client, chain, Path(folder))
        joints = list(range(len(drives)))
        for k in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
            pybullet.changeDynamics(
                body, k, linearDamping=0, angularDamping=0, jointDamping=0, physicsClientId=client
            )  # fmt: skip
        for j, drive in enumerate(drives):
            pybullet.setJointMotorControl2(
                body, j, pybullet.VELOCITY_CONTROL, targetVelocity=0, force=drive.coulomb_friction,
                physicsClientId=client,
            )  # fmt: skip
        return _stepped(client, body, joints, drives, commands)
    finally:
        pybullet.disconnect(physicsClientId=client)


def _stepped(client: int, body: int, joints: list[int], drives: list[Servo], commands: np.ndarray) -> np.ndarray:
    inner = round(1 / RATE / STEP)
    sent = [deque([0.0] * round(drive.delay / STEP)) for drive in drives]
    points, last = [0.0] * len(drives), [0.0] * len(drives)
    out, count = np.empty(commands.shape), 0
    for k, command in enumerate(commands):
        # A force acts half a step to either side of the position that it is given at: rows are half a step back.
        rows = pybullet.getJointStates(body, joints, physicsClientId=client)
        out[k] = [position - 0.5 * STEP * velocity for position, velocity, *_ in rows]
        for _ in range(inner):
            states = pybullet.getJointStates(body, joints, physicsClientId=client)
            places, forces = np.array([each[0] for each in states]), []
            for j, drive in enumerate(drives):
                sent[j].append(float(command[j]))
                asked = sent[j].popleft()
                fastest = drive.velocity_limit * STEP
                before = points[j]
                points[j] += min(max(asked - before, -fastest), fastest)
                point = points[j] if fastest == np.inf else 0.5 * (before + points[j])
                error = point - states[j][0]
                error = np.sign(error) * max(abs(error) - drive.deadband / 2, 0.0)
                force = min(max(drive.proportional_gain * error, -drive.torque_limit), drive.torque_limit)
                # The engine's velocities are those in the middle of its last step: half a step on, they are these.
                velocity, last[j] = 1.5 * states[j][1] - 0.5 * last[j], states[j][1]
                beside = 0.0 if drive.unknown is None else drive.unknown(count * STEP, places, velocity, force)
                forces.append(force - drive.viscous_damping * velocity + beside)
            pybullet.setJointMotorControlArray(
                body, joints, pybullet.TORQUE_CONTROL, forces=forces, physicsClientId=client
            )  # fmt: skip
            pybullet.stepSimulation(physicsClientId=client)
            count += 1
    return out


# The recording


def _write(folder: Path, chain: Chain, drives: list[Servo], log: dict[str, np.ndarray]) -> None:
    names: Callable[[int], str] = "joint{}".format
    believed: dict[str, Any] = {
        names(j): {
            "command": "position",
            "proportional_gain": drive.proportional_gain,
            "torque_limit": drive.torque_limit,
            "viscous_damping": drive.viscous_damping,
            "coulomb_friction": drive.coulomb_friction,
        }
        for j, drive in enumerate(drives)
    }
    head = {
        "format": "vision-s2r/recording/1",
        "kind": "arm",
        "model": "arm.urdf",
        "sample_time": 1 / RATE,
        "tip": f"link{len(drives) - 1}",
        "joints": believed,
    }
    (folder / "arm.urdf").write_text(_urdf(chain))
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    form = ["%d"] + ["%.8g"] * (len(log) - 1)
    table = np.stack(list(log.values()), axis=1)
    np.savetxt(folder / "arm.csv", table, form, ",", header=",".join(log), comments="")
