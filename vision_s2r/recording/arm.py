"""Recordings of an arm: its model, and arm.csv or arm.parquet, beside their header."""

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np

from vision_s2r.arm.model import ArmModel, ModelJoint, opened
from vision_s2r.errors import UserError, check_keys
from vision_s2r.recording import header, joint, table
from vision_s2r.recording.data import ArmRecording, JointRecording
from vision_s2r.recording.table import LARGEST_VALUE

KEYS = ("format", "kind", "model", "sample_time", "tip", "joints", "hold")
MODES = ("position", "velocity", "torque")
DRIVE = (
    *("proportional_gain", "derivative_gain", "torque_limit"),
    *("armature", "viscous_damping", "coulomb_friction"),
)
QUANTITIES = ("command", "position", "velocity", "torque")
LONGEST_NAME = 200  # letters
ROTORLESS = 1e-9  # kg·m², of a rotor that weighs nothing
DEGREES = 180 / math.pi
BEYOND = 2.0  # times a joint's limit, that are no overshoot
NEAR_DEGREES = 1.3  # a factor about DEGREES
OFTEN = 0.01  # of the rows, in which a velocity servo asks for more than its limit
FOLLOWS = 0.9  # correlation of a command with the position


def read(folder: Path, content: Mapping[str, Any], hold_out: bool) -> ArmRecording:
    """The recording of a folder whose header is `content`. Raises UserError for whatever cannot be."""
    where = str(folder / "recording.yaml")
    check_keys(content, KEYS, where, ("model", "sample_time", "joints"))
    sample_time = header.number(content, "sample_time", where, 0.0, 1e3, inclusive=False)
    model = opened(_model_path(folder, content["model"], where))
    given = {name: each or {} for name, each in header.mapping(content, "joints", where).items()}
    if not given:
        raise UserError(f"{where}: joints is empty, expected those that were logged")
    known = {name: model.check_joint(name, f"{where}: joints") for name in given}
    drives = {name: _drive(header.mapping(given, name, where), known[name], f"{where}: {name}") for name in given}
    columns, lines, path = _columns(folder, list(given))
    _check_units(columns, known, drives, path)
    joints = {}
    for name, (mode, nominal, limit) in drives.items():
        seen = Path(f"{path}, joint {name}")  # for messages
        units = cast(Literal["rotary", "linear"], known[name].units)
        own = {key: columns[key] for key in ("episode", "t")}
        own |= {key: columns[f"{key}.{name}"] for key in QUANTITIES[:3] if f"{key}.{name}" in columns}
        joints[name] = joint.of_rows(nominal, sample_time, units, own, "command", lines, hold_out, seen)
        if mode == "velocity":
            joints[name].left_out.update(_unlimited(joints[name], limit))
    if not any(np.ptp(each.command[np.isfinite(each.position)]) > 0 for each in joints.values()):
        raise UserError(f"{path}: no command ever moves, expected one that does")
    return ArmRecording(
        model.path, joints, {name: mode for name, (mode, *_) in drives.items()}, _hold(content, model, given, where),
        _tip(content, model, where), _torque(columns, list(joints), lines, Path(path)),
    )  # fmt: skip


def _unlimited(recording: JointRecording, limit: float) -> dict[str, str]:
    """The torque limit (N·m, N) of a velocity servo, which is not simulated, where its law asks for more."""
    velocity = np.gradient(recording.position, axis=1) / np.gradient(recording.time, axis=1)
    asked = np.abs(recording.nominal["torque_constant"] * (recording.command - velocity))
    share = float((asked[np.isfinite(asked)] > limit).mean())
    why = f"a velocity servo's is not simulated, and its law asks for more than {limit:g} in {share:.0%} of the rows"
    return {"torque_limit": why} if share > OFTEN else {}


def _torque(columns: Mapping[str, np.ndarray], joints: Iterable[str], lines: np.ndarray, path: Path) -> dict[str, Any]:
    """Torques [E, T] of the joints that logged one."""
    episodes = list(table.episodes(columns["episode"], lines, path).values())
    logged = [name for name in joints if f"torque.{name}" in columns]
    return {name: table.padded(columns[f"torque.{name}"], episodes, np.nan) for name in logged}


def _model_path(folder: Path, name: Any, where: str) -> Path:
    known = isinstance(name, str) and 0 < len(name) < LONGEST_NAME
    if not known or Path(name).is_absolute() or ".." in Path(name).parts:
        raise UserError(f"{where}: model is {name!r:.60}, expected a file in the folder, as in arm.xml")
    return folder / name


def _drive(given: Mapping[str, Any], known: ModelJoint, where: str) -> tuple[str, dict[str, float], float]:
    """What is commanded, the arguments of `vision_s2r.joint.NominalJoint`, and the torque limit (N·m, N).

    What is left out is the model's own.
    """
    check_keys(given, ("command", *DRIVE), where)
    mode = header.choice(given, "command", MODES, where, "position")
    values = dict.fromkeys(DRIVE, 0.0) | {"torque_limit": math.inf} | known.drive
    for key in DRIVE:
        if key in given:
            values[key] = header.number(given, key, where, 0.0, LARGEST_VALUE, inclusive=key != "torque_limit")
    nominal = {
        "torque_constant": 1.0,
        "inertia": max(values["armature"], ROTORLESS),
        "viscous_damping": values["viscous_damping"],
        "coulomb_friction": values["coulomb_friction"],
        "gravity_torque": 0.0,
        "bias_torque": 0.0,
    }
    if mode == "torque":
        return mode, nominal, values["torque_limit"]
    if values["proportional_gain"] == 0:
        raise UserError(f"{where}: proportional_gain is missing, neither the header nor the model has it")
    if mode == "velocity":  # K_p·(command − q̇) is a torque, and damping besides
        damping = values["viscous_damping"] + values["proportional_gain"]
        nominal |= {"torque_constant": values["proportional_gain"], "viscous_damping": damping}
        return mode, nominal, values["torque_limit"]
    law = {key: values[key] for key in ("proportional_gain", "derivative_gain")}
    limit = {"command_limit": values["torque_limit"]} if values["torque_limit"] < math.inf else {}
    return mode, nominal | law | limit, values["torque_limit"]


def _columns(folder: Path, joints: list[str]) -> tuple[dict[str, np.ndarray], np.ndarray, Path]:
    """The columns by name, and the line or row of each, of the table that there is."""
    check: Callable[[list[str], Path], None] = partial(_check_names, joints)
    path = folder / "arm.parquet"
    if not path.is_file():
        path = folder / "arm.csv"
        return *table.columns(path, check), path
    import pandas

    try:
        frame = pandas.read_parquet(path)
    except ImportError as error:
        raise UserError("parquet files need pyarrow: pip install 'vision-s2r[lerobot]'") from error
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read as parquet ({str(error).splitlines()[0]})") from error
    check([str(name) for name in frame.columns], path)
    try:
        columns = {str(name): frame[name].to_numpy(np.float64) for name in frame.columns}
    except (TypeError, ValueError) as error:
        raise UserError(f"{path}: a column is no numbers ({str(error).splitlines()[0]})") from error
    lines = np.arange(len(frame))
    if not len(lines):
        raise UserError(f"{path}: no row, expected one a sample")
    table.check_values(columns, lines, path)
    return columns, lines, path


def _check_names(joints: list[str], names: list[str], path: Path) -> None:
    """UserError unless these are columns of an arm with these joints, and none is missing."""
    known, needed = (
        ["episode", "t", *(f"{key}.{name}" for name in joints for key in quantities)]
        for quantities in (QUANTITIES, QUANTITIES[:2])
    )
    table.check_names(names, known, needed, path)


def _check_units(
    columns: Mapping[str, np.ndarray],
    known: Mapping[str, ModelJoint],
    drives: Mapping[str, tuple[str, Any, float]],
    path: Path,
) -> None:
    """UserError for angles in degrees: far beyond a joint's limits, or 57.3 times what they belong to."""
    for name, each in known.items():
        if each.units != "rotary":
            continue
        asked = ["command"] if drives[name][0] == "position" else []
        for key in ("position", *asked):
            reach, limit = float(np.abs(columns[f"{key}.{name}"]).max()), max(abs(each.low), abs(each.high))
            if BEYOND * limit < reach < BEYOND * limit * DEGREES:
                raise UserError(
                    f"{path}: {key}.{name} reaches {reach:.4g}, but the joint's limit is {limit:.4g} rad: is it in "
                    f"degrees ({DEGREES:.1f} to a rad)?"
                )
        if asked:
            _check_one_unit(columns[f"command.{name}"], columns[f"position.{name}"], name, path)


def _check_one_unit(command: np.ndarray, position: np.ndarray, name: str, path: Path) -> None:
    asked, seen = float(np.std(command)), float(np.std(position))
    if not (asked and seen) or np.corrcoef(command, position)[0, 1] < FOLLOWS:
        return
    for factor, key in ((asked / seen, "command"), (seen / asked, "position")):
        if 1 / NEAR_DEGREES < factor / DEGREES < NEAR_DEGREES:
            other = "position" if key == "command" else "command"
            raise UserError(
                f"{path}: {key}.{name} is {factor:.3g} times {other}.{name}: is it in degrees ({DEGREES:.1f} to a rad)?"
            )


def _hold(content: Mapping[str, Any], model: ArmModel, logged: Iterable[str], where: str) -> dict[str, float]:
    """Positions of joints that were not logged: one for all of them, or by name."""
    value = content.get("hold", "0")
    others = [name for name in model.joints if name not in logged]
    if not isinstance(value, dict):
        at = header.number({"hold": value}, "hold", where, -LARGEST_VALUE, LARGEST_VALUE)
        return dict.fromkeys(others, at) if "hold" in content else {}
    for name in value:
        model.check_joint(name, f"{where}: hold")
        if name not in others:
            raise UserError(f"{where}: hold has {name}, which was logged, expected only other joints")
    return {name: header.number(value, name, f"{where}: hold", -LARGEST_VALUE, LARGEST_VALUE) for name in value}


def _tip(content: Mapping[str, Any], model: ArmModel, where: str) -> str | None:
    return header.choice(content, "tip", model.places(), where) if "tip" in content else None
