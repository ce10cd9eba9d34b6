"""Generated arms: drawn chains and public URDFs under position servos, by PyBullet; logs of their motion."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vision_s2r.gapbench.generate import arm_bodies
from vision_s2r.gapbench.generate.arm_bodies import ArmBodies
from vision_s2r.gapbench.generate.arm_bullet import GRAVITY, Real, Servo, loads, run, tip_heights, weight_by_joint
from vision_s2r.gapbench.generate.arm_unknown import UNKNOWN
from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine

CASES = ("null", "single", "pair", "whole_pair", "unknown", "known_unknown")
TABLE = 0.2  # of what the tip is asked for is below a table …
CLEAR = 0.02  # m: … and where it begins is so much above it, at least
EPISODES, SECONDS = 4, 8.0
NOISE = 2e-4  # rad
SECOND = ("latency", "proportional_gain", "torque_saturation", "viscous_damping", "deadband", "coulomb_friction")
FIRST = (*SECOND, "payload", "velocity_limit", "base_tilt", "position_offset", "derivative_on_error")
WHOLE_PAIRS = (("payload", "position_offset"), ("position_offset", "position_offset"), ("payload", "base_tilt"))
FELT = {"single": 0.5, "whole_pair": 0.2}  # of what the offset of any joint does to weights, that one is to do


@dataclass(frozen=True)
class ArmLog:
    """How long an arm is logged, and how often."""

    rate: float = 100.0  # Hz
    episodes: int = EPISODES
    seconds: float = SECONDS  # of each


def machine(
    case: str, index: int, split: str, rng: np.random.Generator, rate: float = 100.0, arms: str = "all"
) -> GeneratedMachine:
    """An arm of two to seven joints; cases take the effects in turn, `unknown` those of its split.

    `pair` is of two joints, `whole_pair` of what all joints feel; `known_unknown` has an effect on one joint, and a
    table that the tip touches.

    arms   chains (drawn ones), public (of URDFs that PyBullet ships), or all (as many of both)
    """
    drawn = arms == "chains" or (arms == "all" and rng.random() < 0.5)
    bodies = arm_bodies.chain(rng) if drawn else arm_bodies.shipped(str(rng.choice(arm_bodies.SHIPPED)))
    servos = believed(bodies, rng)
    real, truth, answer = _with_effects(case, index, split, bodies, servos, rng)
    log = ArmLog(rate, EPISODES, SECONDS)
    columns = logged(real, truth, log, rng)
    return GeneratedMachine(answer, lambda folder: write(folder, bodies, servos, log, columns))


def _with_effects(
    case: str, index: int, split: str, bodies: ArmBodies, servos: list[Servo], rng: np.random.Generator
) -> tuple[Real, list[Servo], Answer]:
    """The arm and its servos as they are."""
    joints = rng.permutation(len(servos))
    effects: Effects = {}
    real, truth, unknown = Real(bodies), list(servos), None
    if case == "unknown":
        unknown, family = list(UNKNOWN[split].items())[index % len(UNKNOWN[split])]
        j = joints[0]
        truth[j] = replace(truth[j], unknown=family(j, len(servos), truth[j].proportional_gain, rng))
    if case == "known_unknown":
        unknown, real = "table", replace(real, table=_table(bodies, rng))
    for name, j in zip(_names(case, index), joints, strict=False):
        if name == "payload":
            payload = drawn_payload(bodies, rng)
            real = replace(real, payload=payload)
            effects[name] = dict(zip(("mass", "x", "y", "z"), payload, strict=True))
        elif name == "base_tilt":
            gravity, effects[name] = _tilted(rng)
            real = replace(real, gravity=gravity)
        elif name == "position_offset":
            true_zeros = [each for each in _felt(bodies, FELT[case]) if truth[each].offset == 0]
            if not true_zeros:
                continue
            j = rng.choice(true_zeros)
            value = float(rng.uniform(0.05, 0.15) * rng.choice([-1, 1]))
            truth[j], effects[f"{bodies.joints[j]}.{name}"] = replace(truth[j], offset=value), {"value": value}
        else:
            truth[j], parameters = with_effect(name, truth[j], rng)
            effects[f"{bodies.joints[j]}.{name}"] = parameters
    notes = {"arm": bodies.name, "joints": len(servos)}
    return real, truth, Answer(case, effects, unknown=unknown, notes=notes)


def _names(case: str, index: int) -> tuple[str, ...]:
    if case in ("null", "unknown"):
        return ()
    if case == "single":
        return (FIRST[index % len(FIRST)],)
    if case == "known_unknown":
        return (SECOND[index % len(SECOND)],)
    pairs = WHOLE_PAIRS if case == "whole_pair" else [(a, b) for a in SECOND for b in SECOND if a != b]
    return pairs[(7 * index) % len(pairs)]


def _table(bodies: ArmBodies, rng: np.random.Generator) -> float:
    """The height (m) of one that the tip comes to now and then."""
    t = np.arange(200) * SECONDS / 200
    asked = np.concatenate([np.stack([home + _motion(t, rng) for home in bodies.home], axis=1) for _ in range(4)])
    begins, heights = tip_heights(bodies, np.array([bodies.home]))[0], tip_heights(bodies, asked)
    return float(min(np.quantile(heights, TABLE), begins - CLEAR))


def _tilted(rng: np.random.Generator) -> tuple[tuple[float, float, float], dict[str, float]]:
    """Gravity in the frame of a base that is not level by 2 to 8 degrees, about an axis between x and y."""
    size, way = rng.uniform(0.035, 0.14), rng.uniform(0, 2 * np.pi)
    roll, pitch = float(size * np.cos(way)), float(size * np.sin(way))
    gravity = (
        GRAVITY * np.sin(pitch), -GRAVITY * np.cos(pitch) * np.sin(roll), -GRAVITY * np.cos(pitch) * np.cos(roll)
    )  # fmt: skip
    return gravity, {"roll": roll, "pitch": pitch}


def _felt(bodies: ArmBodies, least: float) -> list[int]:
    """Joints whose weights say where their zero is: one that turns about the vertical says nothing."""
    change = weight_by_joint(bodies)
    return [int(j) for j in np.flatnonzero(change >= least * change.max())]


def drawn_payload(bodies: ArmBodies, rng: np.random.Generator) -> tuple[float, ...]:
    """Something to carry: its mass (kg), and where it is on the tip (m)."""
    place = [float(rng.uniform(*ends)) for ends in bodies.reach]
    return _payload(bodies, place, float(rng.uniform(0.05, 0.17)))


def _payload(bodies: ArmBodies, place: list[float], share: float) -> tuple[float, ...]:
    """What weighs, at this place, on some joint this share of what the arm itself weighs on its most burdened one."""
    empty, full = (
        loads(Real(bodies, payload), np.random.default_rng(0)).weight for payload in (None, (1.0, *place))
    )  # fmt: skip
    return float(share * empty.max() / max((full - empty).max(), 1e-3)), *place


def believed(bodies: ArmBodies, rng: np.random.Generator) -> list[Servo]:
    """Servos that are strong enough for the arm with something to carry, and for what the others' motion does to it."""
    at = loads(Real(bodies, _payload(bodies, [high for _, high in bodies.reach], 0.1)), rng)
    found = []
    for inertia, coupled, weight in zip(at.inertia, at.coupled, at.weight, strict=True):
        gain = float((inertia + coupled) * rng.uniform(15, 25) ** 2 + 4 * weight)
        damping = float(2 * rng.uniform(0.4, 0.8) * np.sqrt(gain * inertia))
        found.append(Servo(gain, float(2.5 * weight + 0.35 * gain), damping, float(0.04 * weight + 0.005 * gain)))
    return found


def with_effect(name: str, servo: Servo, rng: np.random.Generator) -> tuple[Servo, dict[str, float]]:
    """A servo with an effect that shows, and the effect's parameters."""
    up = float(rng.uniform(1.3, 1.7))
    value: float
    if name in ("proportional_gain", "viscous_damping", "coulomb_friction"):
        value = getattr(servo, name) * (up if rng.random() < 0.5 else 1 / up)
        if name == "coulomb_friction":
            value = servo.coulomb_friction * float(rng.uniform(2, 3))
        changed: dict[str, Any] = {name: value}
        return replace(servo, **changed), {"value": value}
    if name == "latency":
        value = float(rng.uniform(0.008, 0.03))
        return replace(servo, delay=value), {"delay": value}
    if name == "deadband":
        value = float(rng.uniform(0.02, 0.05))
        return replace(servo, deadband=value), {"width": value}
    if name == "velocity_limit":
        value = float(rng.uniform(0.8, 1.6))
        return replace(servo, velocity_limit=value), {"value": value}
    if name == "derivative_on_error":
        value, time = servo.viscous_damping * float(rng.uniform(0.3, 0.8)), float(rng.uniform(0.005, 0.02))
        return replace(servo, error_rate_gain=value, error_filter=time), {"gain": value, "time_constant": time}
    value = servo.torque_limit * float(rng.uniform(0.35, 0.5))
    return replace(servo, torque_limit=value), {"limit": value}


# The log


def logged(real: Real, servos: list[Servo], log: ArmLog, rng: np.random.Generator) -> dict[str, np.ndarray]:
    """The columns: episode, t, and of each joint command and position."""
    columns: dict[str, list[np.ndarray]] = {}
    t = np.arange(round(log.seconds * log.rate)) / log.rate
    for episode in range(log.episodes):
        commands = np.stack([home + _motion(t, rng) for home in real.bodies.home], axis=1)
        positions = run(real, servos, commands, log.rate)
        found = {"episode": np.full(len(t), episode), "t": t}
        for j, name in enumerate(real.bodies.joints):
            found |= {f"command.{name}": commands[:, j]}
            found |= {f"position.{name}": positions[:, j] + NOISE * rng.standard_normal(len(t))}
        for name, values in found.items():
            columns.setdefault(name, []).append(values)
    return {name: np.concatenate(values) for name, values in columns.items()}


def _motion(t: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sines and steps, which begin where the arm is."""
    slow, fast = rng.uniform(1.0, 2.5), rng.uniform(3.0, 8.0)
    sines = 0.5 * np.sin(slow * t) + 0.15 * np.sin(fast * t)
    levels = rng.uniform(-0.25, 0.25, 2 * int(t[-1] / 0.5) + 2)
    levels[0] = 0.0
    return np.asarray(sines + levels[(t / rng.uniform(0.5, 1.0)).astype(int)])


def write(folder: Path, bodies: ArmBodies, servos: list[Servo], log: ArmLog, columns: Mapping[str, np.ndarray]) -> None:
    """The recording: the model as it is public or drawn, what is believed of its servos, and the log."""
    keys = ("proportional_gain", "torque_limit", "viscous_damping", "coulomb_friction")
    head = {
        "format": "vision-s2r/recording/1",
        "kind": "arm",
        "model": "arm.urdf",
        "sample_time": 1 / log.rate,
        "tip": bodies.tip,
        "joints": {
            name: {"command": "position"} | {key: getattr(servo, key) for key in keys}
            for name, servo in zip(bodies.joints, servos, strict=True)
        },
    }
    (folder / "arm.urdf").write_text(bodies.urdf, encoding="utf-8")
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    form = ["%d"] + ["%.8g"] * (len(columns) - 1)
    table = np.stack(list(columns.values()), axis=1)
    np.savetxt(folder / "arm.csv", table, form, ",", header=",".join(columns), comments="")
