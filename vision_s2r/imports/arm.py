"""The joints of a log as one arm: which of the model's each is, in which direction it counts, and where its zero is.

Logs say none of it. A position servo gives way by what weighs on it: its error is the load over its gain, friction
aside. The signs and zeros are those under which the model's weight explains the errors of slow motion best, within the
limits of the joints; the model's own zeros, where those explain them about as well, since whoever calibrated the
arm is likely to have meant them.
"""

import itertools
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.optimize import minimize
from scipy.signal import savgol_filter

from vision_s2r.arm.bodies import Bodies
from vision_s2r.arm.model import ArmModel
from vision_s2r.errors import UserError, nearest
from vision_s2r.files import whole_folder, write
from vision_s2r.imports.drives import known_drive
from vision_s2r.imports.table import ImportOptions, JointTable, read_back
from vision_s2r.recording.header import FORMAT
from vision_s2r.recording.table import text as table_text

# What a recording of an arm calls what one of a joint has under control, and under nominal.
LAW = {"proportional_gain": "proportional", "derivative_gain": "derivative", "torque_limit": "limit"}
BELIEFS = {"armature": "inertia", "viscous_damping": "viscous_damping", "coulomb_friction": "coulomb_friction"}
ROWS = 300  # that are looked at
SLOW = 0.6  # of the speeds, those that count
SMOOTH = 11  # rows that speeds are read off
REST = 0.15  # of a joint's large speeds, below which it is at rest
HEAVY = 0.05  # of the largest weight that comes on any joint: what less comes on has no say
FARTHEST = 1.8  # rad, that a zero is off at most
GRID = 5  # places of each zero from which the best of all is looked for
SIDE, EVALUATIONS = 0.15, 150  # rad of the first simplex of zeros, and how often weights are worked out
BEYOND = 0.05  # rad beyond a limit, that encoders may show
MIRROR = "; its mirror image, all of these turned round, weighs the same"
SURE = 1.3  # times as much of the errors' variance has to be left by what is likelier beforehand, to be given up
FIRM = 0.2  # of that variance, that zeros other than the model's leave at most: below, weight is what one sees
AS_POSITIONS = "an arm's is what its positions show"
CLEAR = 0.05  # of the errors' variance that another sign must leave more, for a sign to be sure


@dataclass(frozen=True)
class Placed:
    """How a log's joints are those of a model: model = sign·log + zero."""

    names: dict[str, str]  # of the model's joints, by those of the log
    sign: dict[str, int]
    zero: dict[str, float]  # rad
    explained: float  # the part of the servo errors' variance in slow motion, friction's apart
    why: dict[str, str]  # by joint of the log, what says so

    def of_model(self, joint: str, values: np.ndarray) -> np.ndarray:
        """Positions of the log as the model counts them."""
        return np.asarray(self.sign[joint] * values + self.zero[joint])


def place(tables: Sequence[JointTable], model: ArmModel, given: Mapping[str, str]) -> Placed:
    """Signs and zeros of joints that were logged together as position servos.

    `given` names the model's joint of each; without it they are the model's in their order. Raises UserError where
    that cannot be.
    """
    logged = [table.name.split("/")[-1] for table in tables]
    names = _names(logged, model, given)
    speeds = np.stack([_speed(table) for table in tables], axis=1)
    rows = _slow_rows(speeds)
    position = np.stack([table.columns["position"][rows] for table in tables], axis=1)
    error = np.stack([table.columns["target"][rows] for table in tables], axis=1) - position
    weigh = _Weight(Bodies(model, list(names.values()), {}), position, error, speeds[rows])
    low, high = (np.array([getattr(model.joints[name], end) for name in names.values()]) for end in ("low", "high"))
    heavy = weigh.heavy()
    own, free = [], []
    for signs in itertools.product((1, -1), repeat=int(heavy.sum())):
        sign = np.ones(len(names))
        sign[heavy] = signs
        least, most = _within(weigh, sign, low, high)
        zero = np.clip(0.0, least, most)
        own.append((weigh.left(sign, zero, heavy), sign, zero))
        free.append(_zeros(weigh, sign, heavy, least, most))
    chosen, tried = _likeliest(own), own
    if (other := min(free, key=_left))[0] < min(chosen[0] / SURE, FIRM):
        chosen, tried = other, free
    left, sign, zero = chosen
    mirrored = next(each for each in tried if (each[1] == -sign)[heavy].all())
    ambiguous = tried is free and mirrored[0] < left + CLEAR
    if ambiguous and mirrored[1].sum() > sign.sum():  # an arm and its mirror image weigh the same: as the log has more
        left, sign, zero = mirrored
    why = {}
    for j, name in enumerate(logged):
        if not heavy[j]:
            why[name] = "nothing weighs on it: as the log has it"
            continue
        others = [each[0] for each in tried if each[1][j] != sign[j] and (each[1] == sign)[heavy].any()]
        worse = min(others, default=1.0) - left
        tells = f"gravity, of which the other sign explains {100 * worse:.0f} % less"
        why[name] = tells if worse > CLEAR or tried is free else "gravity does not tell: as the log has it"
        why[name] += "; no other zero is clearly better" if tried is own else MIRROR * ambiguous
    keyed = dict(zip(logged, range(len(logged)), strict=True))
    return Placed(
        names,
        {name: int(sign[j]) for name, j in keyed.items()},
        {name: float(zero[j]) for name, j in keyed.items()},
        1 - left,
        why,
    )


def write_arms(tables: Sequence[JointTable], out: Path, options: ImportOptions) -> list[tuple[Path, dict[str, Any]]]:
    """Write each motion of a log as a recording of an arm, into folders of `out`, or `out` where there is only one.

    Signs and zeros are those that all motions together show. Returns folders, and what import.json holds. Raises
    UserError where the log is of no position servos, or the drive is not known.
    """
    model = ArmModel(Path(options.model))
    if options.tip and options.tip not in model.places():
        raise UserError(f"tip: no '{options.tip}' in {model.path.name}, {nearest(options.tip, model.places())}")
    if lacking := [table.name for table in tables if not {"target", "position"} <= table.columns.keys()]:
        raise UserError(f"{lacking[0]}: no target in the log, expected position servos for an arm")
    if all(table.of_model for table in tables) and not options.joints:
        tables = [table for table in tables if table.name in model.joints]
        if not tables:
            raise UserError(f"{model.path}: has none of the log's joints, expected some of {', '.join(model.joints)}")
    motions: dict[str, list[JointTable]] = {}
    for table in tables:
        motions.setdefault(table.name.rpartition("/")[0], []).append(table)
    joined = [_joined(parts) for parts in zip(*motions.values(), strict=True)]
    placed = _as_named(joined) if joined[0].of_model else place(joined, model, options.joints)
    found = []
    for name, parts in motions.items():
        folder = out / name if len(motions) > 1 else out
        with whole_folder(folder) as making:
            summary = _write(parts, placed, model, making, options)
            read_back(making, name or folder.name)
        found.append((folder, summary))
    return found


def _as_named(tables: Sequence[JointTable]) -> Placed:
    """Joints that are the model's own."""
    names = [table.name for table in tables]
    why = dict.fromkeys(names, "the model's own, by its name")
    return Placed(dict(zip(names, names, strict=True)), dict.fromkeys(names, 1), dict.fromkeys(names, 0.0), 1.0, why)


def _joined(tables: Sequence[JointTable]) -> JointTable:
    """One joint's motions, one after the other."""
    keys = ("t", "target", "position")
    columns = {key: np.concatenate([table.columns[key] for table in tables]) for key in keys}
    steps = np.concatenate([np.diff(table.columns["t"], prepend=-1.0) for table in tables])
    return JointTable(tables[0].name, {**columns, "t": np.cumsum(steps)}, tables[0].drive, of_model=tables[0].of_model)


def _write(
    tables: Sequence[JointTable], placed: Placed, model: ArmModel, folder: Path, options: ImportOptions
) -> dict[str, Any]:
    columns = {key: tables[0].columns[key] for key in ("episode", "t")}
    drives = {}
    for table in tables:
        joint = table.name.split("/")[-1]
        known = known_drive(options.drive or table.drive)
        nominal, law = {**known.nominal, **options.nominal}, {**known.control, **options.control}
        if "proportional" in law:  # one servo's law: the model's derivative gain goes with its own proportional one
            law = {"derivative": 0.0, **law}
        given = {key: law.get(theirs) for key, theirs in LAW.items()}
        given |= {key: nominal.get(theirs) for key, theirs in BELIEFS.items()}
        name = placed.names[joint]
        # What is not given, the model's actuators and joints say.
        drives[name] = {"command": "position", **{key: value for key, value in given.items() if value is not None}}
        for key, ours in (("target", "command"), ("position", "position")):
            columns[f"{ours}.{name}"] = placed.of_model(joint, table.columns[key])
        if "effort" in table.columns:
            columns[f"torque.{name}"] = placed.sign[joint] * table.columns["effort"]
    step = float(np.median(np.diff(columns["t"])))
    tip = {"tip": options.tip} if options.tip else {}
    head = {"format": FORMAT, "kind": "arm", "model": model.path.name, "sample_time": step, **tip, "joints": drives}
    write(folder / "arm.csv", table_text(list(columns), np.column_stack(list(columns.values()))))
    write(folder / "recording.yaml", yaml.safe_dump(head, sort_keys=False))
    shutil.copy(model.path, folder / model.path.name)
    signs = {1: "+", -1: "−"}
    lines = [
        f"{placed.names[name]} is {signs[placed.sign[name]]}{name} {placed.zero[name]:+.3f} rad: {placed.why[name]}"
        for name in placed.names
    ]
    summary = {"rows": len(columns["t"]), "explained": placed.explained, "joints": lines, "left_out": _left_out(tables)}
    write(folder / "import.json", json.dumps(summary, indent=1, ensure_ascii=False) + "\n")
    return summary


def _left_out(tables: Sequence[JointTable]) -> list[str]:
    """What of the log is not in the recording, and why; joints of one reason together."""
    said: dict[tuple[str, str], list[str]] = {}
    for table in tables:
        given = {**table.left_out, **({"velocity": AS_POSITIONS} if "velocity" in table.columns else {})}
        for key, why in given.items():
            if not (key == "effort" and key in table.columns):  # which is there as a torque
                said.setdefault((key, why), []).append(table.name.split("/")[-1])
    return [f"{key} of {', '.join(names)}: {why}" for (key, why), names in said.items()]


def _names(logged: list[str], model: ArmModel, given: Mapping[str, str]) -> dict[str, str]:
    for name in given:
        if name not in logged:
            raise UserError(f"joints: the log has no joint '{name}', {nearest(name, logged)}")
    if not given and len(logged) > len(model.joints):
        raise UserError(
            f"{model.path}: {len(model.joints)} joints, but the log has {len(logged)}: say which, with joints"
        )
    names = dict(given) or dict(zip(logged, model.joints, strict=False))
    for name in names.values():
        model.check_joint(name, "joints")
    if missing := [name for name in logged if name not in names]:
        raise UserError(f"joints: nothing said of {', '.join(missing)}, expected the model's joint of each")
    return names


def _speed(table: JointTable) -> np.ndarray:
    """Speeds [N] (rad/s) of a joint, smoothed over the encoder's steps."""
    step = float(np.median(np.diff(table.columns["t"])))
    return np.asarray(savgol_filter(table.columns["position"], SMOOTH, 2, deriv=1, delta=step))


def _slow_rows(speeds: np.ndarray) -> np.ndarray:
    """Rows in which some joint moves and none is fast, spread over the log."""
    shares = np.abs(speeds) / (np.quantile(np.abs(speeds), 0.95, axis=0) + 1e-9)
    fastest = shares.max(axis=1)
    moving = fastest > REST
    slow = np.flatnonzero(moving & (fastest <= np.quantile(fastest[moving], SLOW)))
    return slow[np.linspace(0, len(slow) - 1, min(ROWS, len(slow))).astype(int)]


class _Weight:
    """What the model's weight explains of servo errors [N, J], under signs and zeros."""

    def __init__(self, bodies: Bodies, position: np.ndarray, error: np.ndarray, speed: np.ndarray) -> None:
        self._bodies, self.position, self._error = bodies, position, error
        self._drag = np.stack([speed, np.sign(speed)], axis=-1)
        self._still = np.zeros(position.shape[1])
        # Of a joint at rest, friction holds as much as it likes.
        self._moves = np.abs(speed) > REST * np.quantile(np.abs(speed), 0.95, axis=0)

    def heavy(self) -> np.ndarray:
        """Whether enough weighs on a joint [J] to tell its sign."""
        size = np.abs(self._loads(self.position)).max(axis=0)
        return np.asarray(size > HEAVY * size.max())

    def left(self, sign: np.ndarray, zero: np.ndarray, heavy: np.ndarray) -> float:
        """The part of what friction leaves of the errors' variance that weight leaves too, over heavy joints."""
        if not heavy.any():
            return 1.0
        loads = self._loads(sign * self.position + zero)
        parts = []
        for j in np.flatnonzero(heavy):
            rows = self._moves[:, j]
            basis, error = np.column_stack([sign[j] * loads[:, j], self._drag[:, j]])[rows], self._error[rows, j]
            found = np.linalg.lstsq(basis, error, rcond=None)[0]
            drag = basis[:, 1:]
            bare = np.mean((error - drag @ np.linalg.lstsq(drag, error, rcond=None)[0]) ** 2)
            # A servo gives way to its load, not against it.
            parts.append(np.mean((error - basis @ found) ** 2) / bare if found[0] > 0 else 1.0)
        return float(np.mean(parts))

    def _loads(self, position: np.ndarray) -> np.ndarray:
        return np.array([self._bodies.terms(q, self._still)[1] for q in position])


def _likeliest(own: list[tuple[float, np.ndarray, np.ndarray]]) -> tuple[float, np.ndarray, np.ndarray]:
    """As the log has it, the first, but where other signs leave clearly less."""
    best = min(own, key=_left)
    return own[0] if own[0][0] < SURE * best[0] else best


def _left(each: tuple[float, np.ndarray, np.ndarray]) -> float:
    return each[0]


def _within(weigh: _Weight, sign: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least and largest zeros [J] under which the log stays within the joints' limits."""
    ends = np.sort(sign[:, None] * np.stack([weigh.position.min(axis=0), weigh.position.max(axis=0)], axis=1), axis=1)
    least, most = low - BEYOND - ends[:, 0], high + BEYOND - ends[:, 1]
    least, most = np.minimum(least, most), np.maximum(least, most)
    return np.clip(least, -FARTHEST, FARTHEST), np.clip(most, -FARTHEST, FARTHEST)


def _zeros(
    weigh: _Weight, sign: np.ndarray, heavy: np.ndarray, least: np.ndarray, most: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """What is left, the signs, and the zeros [J] of joints that weight tells, others' 0 or what limits ask for."""
    zero = np.clip(0.0, least, most)
    if not heavy.any():
        return 1.0, sign, zero

    def left(some: np.ndarray) -> float:
        whole = zero.copy()
        whole[heavy] = np.clip(some, least[heavy], most[heavy])
        return weigh.left(sign, whole, heavy)

    grid = (np.linspace(a, b, GRID) for a, b in zip(least[heavy], most[heavy], strict=True))
    near = np.array(min(itertools.product(*grid), key=lambda some: left(np.array(some))))
    start = near + np.vstack([np.zeros(heavy.sum()), SIDE * np.eye(heavy.sum())])
    options = {"maxfev": EVALUATIONS, "xatol": 2e-3, "fatol": 1e-4, "initial_simplex": start}
    found = minimize(left, zero[heavy], method="Nelder-Mead", options=options)
    zero[heavy] = np.clip(found.x, least[heavy], most[heavy])
    return float(found.fun), sign, zero
