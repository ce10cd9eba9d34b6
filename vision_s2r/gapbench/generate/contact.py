"""Generated tosses: bodies of every case, drawn so that each of their effects shows in the motion.

An effect shows when it moves the body, over a quarter of a second from the same state, by 3 (mild) to 100 times
(severe) the noise of measured positions, at its median over the windows in which it acts; in pairs each effect does,
beside the other. What a confusable recording hides shows less than the noise in tosses that are all thrown one way.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vision_s2r.gapbench.generate.base import Answer, Effects, GeneratedMachine, Redraw, drawn
from vision_s2r.gapbench.generate.body import COARSE, FIELDS, FINE, TossedBody, move

CASES = ("null", "dynamics", "single", "pair", "unknown", "weak", "left_out", "confusable")
TOSSES, SHOWN = 24, 4  # in a recording, and of them to measure how an effect shows
MILD, SEVERE = 3.0, 100.0
WEAK = (0.02, 0.3)
LOUD = {"contact_compliance": (30.0, 300.0)}  # severities: a spring's rebound is not Newton's, however hard it is
WINDOW = 0.25  # s
HIDDEN = 0.2  # of the noise: an effect, or what is left of it beside another, that nobody can tell
SLIGHT = 0.01  # intensity of an effect that is scaled to imitate another
ALL_ALIKE = 12  # tosses of a recording that hides an effect
ASKED = 1.0  # s that a toss is recorded which a report asks for
ACTS = 0.1  # of the largest change that an effect makes to a window: it acts where its change is larger
APART = {"restitution", "contact_compliance"}  # what they do together depends on whose spring it is

COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "wx", "wy", "wz")

Family = Callable[[float, TossedBody, np.random.Generator], dict[str, float]]


@dataclass(frozen=True)
class Setting:
    """What the simulator believes, how the body is thrown, and the noise of its poses."""

    nominal: TossedBody
    shape: dict[str, Any]  # as a recording's header has it
    points: np.ndarray
    radius: float
    inertia: np.ndarray  # of unit mass
    size: float  # m
    first: np.ndarray  # [TOSSES, 13]
    samples: int
    sample_time: float
    noise: tuple[float, float]  # m, rad
    velocity_noise: tuple[float, float] | None  # m/s, rad/s

    def tossed(
        self, body: TossedBody, first: np.ndarray | None = None, samples: int | None = None, longest: float = FINE
    ) -> np.ndarray:
        """States [E, T, 13]."""
        starts = self.first if first is None else first
        count = samples or self.samples
        return np.stack(
            [
                move(body, self.points, self.radius, self.inertia, row, count, self.sample_time, longest)
                for row in starts
            ]
        )

    def severity(self, body: TossedBody, without: TossedBody) -> float:
        """How far two bodies come apart in windows that begin alike, in units of the poses' noise."""
        starts = self.starts(body, self.first[:: TOSSES // SHOWN - 1][:SHOWN])
        change = np.linalg.norm(self._ends(body, starts)[:, :3] - self._ends(without, starts)[:, :3], axis=-1)
        acting = change[change > ACTS * np.quantile(change, 0.9)]
        return float(np.median(acting)) / self.noise[0] if len(acting) else 0.0

    def starts(self, body: TossedBody, first: np.ndarray) -> np.ndarray:
        """States [W, 13] that windows of a body's tosses begin at."""
        length = max(2, round(WINDOW / self.sample_time))
        return self.tossed(body, first, longest=COARSE)[:, :-length:length].reshape(-1, 13)

    def apart(self, body: TossedBody, starts: np.ndarray) -> np.ndarray:
        """How far a body's windows [W, 6] from these states end from the nominal one's, in units of the noise."""
        one, other = self._ends(body, starts), self._ends(self.nominal, starts)
        turn = 2 * _product(one[:, 3:7], other[:, 3:7] * (-1, -1, -1, 1))
        turn = turn[:, :3] * np.where(turn[:, 3:] < 0, -1.0, 1.0)
        return np.concatenate([(one - other)[:, :3] / self.noise[0], turn / self.noise[1]], axis=1)

    def _ends(self, body: TossedBody, starts: np.ndarray) -> np.ndarray:
        """Where windows end that begin at these states [W, 13]."""
        return self.tossed(body, starts, max(2, round(WINDOW / self.sample_time)) + 1, COARSE)[:, -1]


def machine(case: str, index: int, split: str, rng: np.random.Generator) -> GeneratedMachine:
    """Draw one machine of a case; see `generate.base`."""

    def draw() -> GeneratedMachine:
        setting = _setting(rng)
        body, answer = _DRAWN[case](setting, index, split, rng)
        if case == "confusable":
            setting = _hiding(setting, body, answer, rng)
        return recorded(setting, body, answer, rng)

    return drawn(draw, f"machine of case '{case}' number {index}")


def _setting(rng: np.random.Generator) -> Setting:
    """A body of the size of a hand, its tosses and its sensors."""
    nominal = TossedBody(
        mass=float(f"{rng.uniform(0.1, 0.6):.3g}"),
        friction=float(f"{rng.uniform(0.15, 0.6):.2g}"),
        restitution=float(f"{rng.uniform(0.0, 0.4):.2g}"),
    )
    kind = rng.choice(["cube", "brick", "ball"], p=[0.5, 0.3, 0.2])
    if kind == "ball":
        shape: dict[str, Any] = {"shape": "sphere", "radius": float(f"{rng.uniform(0.03, 0.06):.3g}")}
    else:
        half = np.full(3, rng.uniform(0.03, 0.06)) * (1 if kind == "cube" else rng.uniform(0.5, 1.0, 3))
        shape = {"shape": "box", "half_extents": [float(f"{x:.3g}") for x in half]}
    points, radius, inertia, size = _geometry(shape)
    rate = rng.uniform(120, 240)
    noise = (math.exp(rng.uniform(*np.log([1e-4, 6e-4]))), math.exp(rng.uniform(*np.log([1e-3, 5e-3]))))
    return Setting(
        nominal=nominal,
        shape=shape,
        points=points,
        radius=radius,
        inertia=inertia,
        size=size,
        first=tosses(TOSSES, points, radius, rng),
        samples=int(0.8 * rate),
        sample_time=float(f"{1 / rate:.5g}"),
        noise=noise,
        velocity_noise=(10 * noise[0], 10 * noise[1]) if rng.random() < 0.3 else None,
    )


def _geometry(shape: dict[str, Any]) -> tuple[np.ndarray, float, np.ndarray, float]:
    """Points, radius, inertia of unit mass and size of a shape of a header."""
    if shape["shape"] == "sphere":
        radius = shape["radius"]
        return np.zeros((0, 3)), radius, 0.4 * radius**2 * np.eye(3), radius
    half = np.array(shape["half_extents"])
    points = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]) * half
    return points, 0.0, np.diag((half**2).sum() - half**2) / 3, float(half.min())


def tosses(count: int, points: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
    """Thrown with a spin, and every third one pushed along its support from a face."""
    first = np.zeros((count, 13))
    for k, row in enumerate(first):
        row[:2] = rng.normal(0, 0.1, 2)
        if k % 3 == 2:
            row[2:7] = _lying(points, radius, rng)
            angle, speed = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 2.0)
            row[7:9] = speed * np.cos(angle), speed * np.sin(angle)
            row[12] = rng.normal(0, 6)
        else:
            row[2] = rng.uniform(0.1, 0.25)
            q = rng.normal(size=4)
            row[3:7] = q / np.linalg.norm(q)
            row[7:10] = rng.normal(size=3) * (1.0, 1.0, 0.4)
            row[10:] = rng.normal(0, 5, 3)
    return first


def _lying(points: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
    """Height and attitude [5] of a body on one of its faces."""
    axis = rng.permutation(np.eye(3)) if len(points) else np.eye(3)
    axis[0] *= np.sign(np.linalg.det(axis))
    return np.array([-(points @ axis.T)[:, 2].min() + 1e-6 if len(points) else radius, *_quaternion(axis)])


def _alike(way: str, points: np.ndarray, radius: float, rng: np.random.Generator) -> np.ndarray:
    """Tosses [ALL_ALIKE, 13] of one of the `WAYS`; a ball that is pushed rolls."""
    first = np.zeros((ALL_ALIKE, 13))
    for row in first:
        row[:2] = rng.normal(0, 0.1, 2)
        row[2:7] = _lying(points, radius, rng)
        if way == "dropped":
            row[2] += rng.uniform(0.05, 0.2)
        elif way == "pushed":
            angle, speed = rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 2.0)
            row[7:9] = speed * np.cos(angle), speed * np.sin(angle)
            row[10:12] = (0.0, 0.0) if len(points) else (-row[8] / radius, row[7] / radius)
        else:
            row[12] = rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 15.0)
    return first


def _quaternion(r: np.ndarray) -> np.ndarray:
    """Of a rotation whose entries are 0 and ±1 (from its eigenvector of eigenvalue 1, as any other)."""
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    return np.asarray(np.linalg.eigh(k / 3)[1][:, -1])


# The effects of the vocabulary: families that grow in one intensity from 0 to 1, and where a report finds them.

_ANGLE = 2 * math.pi


def _friction(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    return {"friction": body.friction * 3.0 ** (rng.choice([-1.0, 1.0]) * x)}


def _restitution(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    end = rng.choice([0.0, 0.8]) if body.restitution > 0.15 else 0.8
    return {"restitution": body.restitution + x * (end - body.restitution)}


def _rolling(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    return {"rolling": 0.02 * x}


def _spinning(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    return {"spinning": 0.03 * x}


def _compliance(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    frequency = 60.0 * 30 ** (1 - x)  # rad/s on one point
    return {
        "stiffness": body.mass * frequency**2,
        "damping": 2 * rng.uniform(0.1, 0.6) * body.mass * frequency,
    }


def _center(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    way = rng.normal(size=3)
    way *= 0.02 * x / np.linalg.norm(way)
    return dict(zip(("center_x", "center_y", "center_z"), way.tolist(), strict=True))


def _rounded(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    return {"rounding": 0.015 * x}


def _tilt(x: float, body: TossedBody, rng: np.random.Generator) -> dict[str, float]:
    angle = rng.uniform(0, _ANGLE)
    return {"roll": 0.2 * x * math.cos(angle), "pitch": 0.2 * x * math.sin(angle)}


LIBRARY: dict[str, tuple[Family, dict[str, str]]] = {
    "lateral_friction": (_friction, {"value": "friction"}),
    "restitution": (_restitution, {"value": "restitution"}),
    "rolling_friction": (_rolling, {"value": "rolling"}),
    "spinning_friction": (_spinning, {"value": "spinning"}),
    "contact_compliance": (_compliance, {"stiffness": "stiffness", "damping": "damping"}),
    "center_of_mass": (_center, {"x": "center_x", "y": "center_y", "z": "center_z"}),
    "corner_radius": (_rounded, {"value": "rounding"}),
    "support_tilt": (_tilt, {"roll": "roll", "pitch": "pitch"}),
}
# Where a report says that one of them shows: the axis, or the axis and the place; the others act everywhere.
_TOUCHING = ("phase: at the first impact", "phase: bouncing")
_WHERE = {
    "lateral_friction": (*_TOUCHING, "phase: sliding"),
    "restitution": _TOUCHING,
    "rolling_friction": (*_TOUCHING, "phase: rolling or tumbling"),
    "spinning_friction": ("spin",),
    "contact_compliance": _TOUCHING,
    "corner_radius": ("part: on a corner", "part: on an edge", *_TOUCHING, "phase: rolling or tumbling"),
}
COEFFICIENTS = ("lateral_friction", "restitution")
NOTICEABLE = 0.03  # share of a nominal value from which a wrong one must be named

WAYS = ("dropped", "pushed", "spun")  # in which people toss who think of one effect: each hides others

# Effects outside the vocabulary, in two lists that share no kind: one to tune on, one to report on.
UNKNOWN: dict[str, dict[str, Family]] = {
    "tuning": {
        "drag": lambda x, body, rng: {"drag": 6 * x},
        "slick_half": lambda x, body, rng: {"patch": -0.9 * x, "patch_place": rng.normal(0, 0.05)},
        "fading_friction": lambda x, body, rng: {"fade": 6 * x},
        "hastening_friction": lambda x, body, rng: {"hastening": 3 * x},
        "lively_half": lambda x, body, rng: {"lively": 0.9 * x, "patch_place": rng.normal(0, 0.05)},
        "lift": lambda x, body, rng: {"lift": x * rng.choice((-1, 1))},
        "spin_drag": lambda x, body, rng: {"spin_drag": 10 * x},
        "squeezed_film": lambda x, body, rng: {"film": 60 * x, "film_reach": rng.uniform(5e-3, 2e-2)},
        "magnet": lambda x, body, rng: {
            "magnet": 20 * x,
            "magnet_x": rng.normal(0, 0.1),
            "magnet_y": rng.normal(0, 0.1),
            "magnet_depth": rng.uniform(0.08, 0.15),
        },
    },
    "reporting": {
        "quadratic_drag": lambda x, body, rng: {"quadratic_drag": 6 * x},
        "adhesion": lambda x, body, rng: {"adhesion": 12 * x, "adhesion_reach": rng.uniform(5e-4, 3e-3)},
        "anisotropic_friction": lambda x, body, rng: {"uneven": 0.9 * x, "uneven_angle": rng.uniform(0, math.pi)},
        "wind": lambda x, body, rng: {
            "wind": 8 * x,
            "wind_angle": rng.uniform(0, _ANGLE),
            "wind_place": rng.normal(0, 0.1),
            "wind_width": rng.uniform(0.15, 0.3),
        },
    },
}


# Drawing bodies, one function a case: (setting, index, split, rng) -> the body and its answer. Raises Redraw.


def _null(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    return setting.nominal, Answer("null")


def _dynamics(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    names = (COEFFICIENTS[index % 2],) if index % 3 else COEFFICIENTS
    return _with_effects(setting, "dynamics", names, rng)


def _single(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    return _with_effects(setting, "single", (list(LIBRARY)[index % len(LIBRARY)],), rng)


def _pair(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    first = list(LIBRARY)[index % len(LIBRARY)]
    second = str(rng.choice([name for name in LIBRARY if name != first]))
    if {first, second} == APART:
        raise Redraw
    return _with_effects(setting, "pair", (first, second), rng)


def _unknown(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    name = list(UNKNOWN[split])[index % len(UNKNOWN[split])]
    body = _of_severity(setting, setting.nominal, UNKNOWN[split][name], rng, (2 * MILD, SEVERE))
    return body, Answer("unknown", unknown=name)


def _weak(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    name = list(LIBRARY)[index % len(LIBRARY)]
    body = _of_severity(setting, setting.nominal, LIBRARY[name][0], rng, WEAK)
    return body, Answer("weak", optional=_effects(body, (name,)))


def _left_out(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    body, answer = _single(setting, index, split, rng)
    (name,) = answer.effects
    return body, replace(answer, case="left_out", effects={}, withhold=name, where=[])


def _confusable(setting: Setting, index: int, split: str, rng: np.random.Generator) -> tuple[TossedBody, Answer]:
    """One effect, drawn: few are hidden by tosses of one way."""
    return _with_effects(setting, "confusable", (str(rng.choice(list(LIBRARY))),), rng)


def _hiding(setting: Setting, body: TossedBody, answer: Answer, rng: np.random.Generator) -> Setting:
    """The setting with tosses of one way, in which the effect hardly shows or another imitates it."""
    for way in rng.permutation(WAYS):
        one = replace(setting, first=_alike(str(way), setting.points, setting.radius, rng))
        starts = one.starts(setting.nominal, one.first)
        change = one.apart(body, starts)
        if min(_size(change), _imitated(one, change, starts, answer, rng)) < HIDDEN:
            return one
    raise Redraw


def _imitated(
    setting: Setting, change: np.ndarray, starts: np.ndarray, answer: Answer, rng: np.random.Generator
) -> float:
    """What of a change of windows [W, 6] no one other effect imitates, to first order; of the noise."""
    rest = [_size(change)]
    for family in (family for name, (family, _) in LIBRARY.items() if name not in answer.effects):
        other = setting.apart(setting.nominal._replace(**family(SLIGHT, setting.nominal, rng)), starts)
        size = float((other * change).sum() / max((other**2).sum(), 1e-12))
        rest.append(_size(change - size * other))
    return min(rest)


def _size(change: np.ndarray) -> float:
    return float(np.sqrt(np.mean(change**2)))


_DRAWN: dict[str, Callable[[Setting, int, str, np.random.Generator], tuple[TossedBody, Answer]]] = {
    "null": _null,
    "dynamics": _dynamics,
    "single": _single,
    "pair": _pair,
    "unknown": _unknown,
    "weak": _weak,
    "left_out": _left_out,
    "confusable": _confusable,
}


def _with_effects(
    setting: Setting, case: str, names: tuple[str, ...], rng: np.random.Generator
) -> tuple[TossedBody, Answer]:
    """A body with these effects, each of which shows beside the others."""
    body = setting.nominal
    for name in names:
        body = _of_severity(setting, body, LIBRARY[name][0], rng, LOUD.get(name, (MILD, SEVERE)))
        if name in COEFFICIENTS:
            field = LIBRARY[name][1]["value"]
            if abs(getattr(body, field) - getattr(setting.nominal, field)) < 2 * NOTICEABLE * max(
                getattr(setting.nominal, field), 0.1
            ):
                raise Redraw
    for name in names if len(names) > 1 else ():
        fields = {field: getattr(setting.nominal, field) for field in LIBRARY[name][1].values()}
        if setting.severity(body, body._replace(**fields)) < MILD:
            raise Redraw
    return body, Answer(case, _effects(body, names), where=list(_WHERE.get(names[0], ())) if len(names) == 1 else [])


def _of_severity(
    setting: Setting, without: TossedBody, family: Family, rng: np.random.Generator, bounds: tuple[float, float]
) -> TossedBody:
    """The member of a family that differs from `without` by a severity drawn uniformly in its logarithm."""
    target = math.exp(rng.uniform(*np.log(bounds)))
    seed = int(rng.integers(2**31))
    low, high, x = math.log(1e-5), 0.0, 0.0
    for _ in range(12):
        body = without._replace(**family(math.exp(x), without, np.random.default_rng(seed)))
        ratio = setting.severity(body, without) / target
        if x == 0 and ratio < 1:
            raise Redraw
        if abs(ratio - 1) < 0.35:
            return body
        low, high = (x, high) if ratio < 1 else (low, x)
        x -= math.log(max(ratio, 1e-9))  # as if it grew in proportion
        if not low < x < high:
            x = (low + high) / 2
    raise Redraw


def _effects(body: TossedBody, names: tuple[str, ...]) -> Effects:
    """The parameters of these effects, in the vocabulary's names."""
    return {name: {key: float(getattr(body, field)) for key, field in LIBRARY[name][1].items()} for name in names}


# The recording


def recorded(setting: Setting, body: TossedBody, answer: Answer, rng: np.random.Generator) -> GeneratedMachine:
    measured = _measured(setting, setting.tossed(body), rng)
    changed = {name: float(value) for name, value in zip(FIELDS, body, strict=True)}
    answer = replace(
        answer,
        severity=setting.severity(body, setting.nominal) if body != setting.nominal else 0.0,
        notes={
            "noise": list(setting.noise),
            "velocity_noise": setting.velocity_noise and list(setting.velocity_noise),
            "shape": setting.shape,
            "machine": changed,
        },
    )
    return GeneratedMachine(answer, lambda folder: _write(folder, setting, measured))


def _measured(setting: Setting, states: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """What sensors show of states [E, T, 13]: poses, and velocities where there is a sensor of them."""
    position = states[..., :3] + rng.normal(0, setting.noise[0], states[..., :3].shape)
    attitude = _jolted(states[..., 3:7], rng.normal(0, setting.noise[1], states[..., :3].shape))
    if setting.velocity_noise is None:
        return np.concatenate([position, attitude], axis=-1)
    sigma = np.repeat(setting.velocity_noise, 3)
    velocity = states[..., 7:] + rng.normal(size=states[..., 7:].shape) * sigma
    return np.concatenate([position, attitude, velocity], axis=-1)


def _jolted(q: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Attitudes [..., 4] turned by small rotation vectors [..., 3]."""
    size = np.linalg.norm(turn, axis=-1, keepdims=True)
    axis = turn / np.maximum(size, 1e-12) * np.sin(size / 2)
    return _product(np.concatenate([axis, np.cos(size / 2)], axis=-1), q)


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of quaternions [..., 4], the turn p after q."""
    vector = p[..., 3:] * q[..., :3] + q[..., 3:] * p[..., :3] + np.cross(p[..., :3], q[..., :3])
    scalar = p[..., 3:] * q[..., 3:] - (p[..., :3] * q[..., :3]).sum(axis=-1, keepdims=True)
    return np.concatenate([vector, scalar], axis=-1)


def _write(folder: Path, setting: Setting, measured: np.ndarray) -> None:
    nominal = setting.nominal
    head = {
        "format": "vision-s2r/recording/1",
        "kind": "contact",
        "sample_time": setting.sample_time,
        "nominal": {
            **setting.shape,
            "mass": nominal.mass,
            "lateral_friction": nominal.friction,
            "restitution": nominal.restitution,
            "gravity": nominal.gravity,
        },
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(head, sort_keys=False))
    names = ["episode", "t", *COLUMNS[: measured.shape[-1]]]
    rows = [",".join(names), *_rows(measured, setting.sample_time, 0)]
    (folder / "contact.csv").write_text("\n".join(rows) + "\n")


def _rows(measured: np.ndarray, sample_time: float, first: int) -> list[str]:
    """Lines of contact.csv, episodes counted from `first`."""
    return [
        f"{episode},{k * sample_time:.8g}," + ",".join(f"{x:.8g}" for x in row)
        for episode, states in enumerate(measured, first)
        for k, row in enumerate(states)
    ]


# What a report asks for


def asked(report: Path, folder: Path, answer: dict[str, Any]) -> np.ndarray:
    """The states [N, 13] that the throws of a report's next_recording.csv are released in."""
    table = np.genfromtxt(report / "next_recording.csv", delimiter=",", names=True)
    return np.stack([np.atleast_1d(table[name]) for name in COLUMNS], axis=1)


def at_random(folder: Path, answer: dict[str, Any], like: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """As many throws [N, 13] as a recording's are drawn."""
    points, radius, *_ = _geometry(answer["notes"]["shape"])
    return tosses(len(like), points, radius, rng)


def continued(folder: Path, out: Path, answer: dict[str, Any], first: np.ndarray, rng: np.random.Generator) -> None:
    """A recording of a body once more, with throws from these states [N, 13] behind those that it has."""
    head, notes = yaml.safe_load((folder / "recording.yaml").read_text()), answer["notes"]
    body = TossedBody(**notes["machine"])
    points, radius, inertia, size = _geometry(notes["shape"])
    step, noise, velocity_noise = head["sample_time"], tuple(notes["noise"]), notes["velocity_noise"]
    samples = round(ASKED / step)
    setting = Setting(
        *(body, notes["shape"], points, radius, inertia, size, first, samples, step, noise, velocity_noise)
    )
    lines = (folder / "contact.csv").read_text().splitlines()
    last = int(lines[-1].partition(",")[0])
    rows = _rows(_measured(setting, setting.tossed(body), rng), step, last + 1)
    out.mkdir(parents=True)
    (out / "recording.yaml").write_text((folder / "recording.yaml").read_text())
    (out / "contact.csv").write_text("\n".join([*lines, *rows]) + "\n")
