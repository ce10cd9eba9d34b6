"""Recordings of a body on its support: contact.csv beside its header."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.contact.shape import Shape, box, cylinder, mesh, sphere
from vision_s2r.errors import UserError, check_keys
from vision_s2r.recording import header, table, tosses
from vision_s2r.recording.data import ContactRecording

KEYS = ("format", "kind", "sample_time", "nominal")
SHAPES = {"box": ("half_extents",), "sphere": ("radius",), "cylinder": ("radius", "length"), "mesh": ("mesh",)}
COEFFICIENTS = ("mass", "lateral_friction", "restitution")
GRAVITY = 9.81  # m/s², where the header has none
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
VELOCITIES = ("vx", "vy", "vz", "wx", "wy", "wz")
COLUMNS = ("episode", "t", *POSE, *VELOCITIES)

SMALLEST, LARGEST = 1e-4, 100.0  # m, of a body
UNIT = 0.02  # by which the norm of a quaternion may differ from 1
STEP_TOLERANCE = 0.1  # of the sample time: one step's
LEAST_EPISODE, LEAST_TOSSES = 10, 4  # rows of an episode, and episodes, to hold some of them out


def read(folder: Path, content: Mapping[str, Any], hold_out: bool) -> ContactRecording:
    """The recording of a folder whose header is `content`. Raises UserError for whatever cannot be."""
    where = str(folder / "recording.yaml")
    check_keys(content, KEYS, where, ("sample_time", "nominal"))
    sample_time = header.number(content, "sample_time", where, 0.0, 1e3, inclusive=False)
    nominal, shape = _nominal(header.mapping(content, "nominal", where), f"{where}: nominal", folder)
    path = folder / "contact.csv"
    columns, lines = table.columns(path, _check_names)
    _check_quaternions(columns, lines, path)
    episodes = table.episodes(columns["episode"], lines, path)
    for rows in episodes.values():
        _check_time(columns["t"][rows], lines[rows], sample_time, path)
    recording = _recording(nominal, shape, sample_time, columns, episodes)
    _check_length(recording, hold_out, path)
    tosses.check(recording, lines, list(episodes.values()), path)
    return recording


def _nominal(given: dict[str, Any], where: str, folder: Path) -> tuple[dict[str, float], Shape]:
    kind = header.choice(given, "shape", SHAPES, where)
    check_keys(given, ("shape", *SHAPES[kind], *COEFFICIENTS, "gravity"), where, (*SHAPES[kind], *COEFFICIENTS))
    nominal = {
        "mass": header.number(given, "mass", where, 0.0, 1e6, inclusive=False),
        "lateral_friction": header.number(given, "lateral_friction", where, 0.0, 10.0),
        "restitution": header.number(given, "restitution", where, 0.0, 1.0),
        "gravity": header.number(given, "gravity", where, 0.0, 1e3, inclusive=False) if "gravity" in given else GRAVITY,
    }
    return nominal, _shape(kind, given, where, folder)


def _shape(kind: str, given: Mapping[str, Any], where: str, folder: Path) -> Shape:
    def size(content: Mapping[str, Any], key: str) -> float:
        return header.number(content, key, where, SMALLEST, LARGEST)

    if kind == "box":
        extents = given["half_extents"]
        if not isinstance(extents, list) or len(extents) != 3:
            raise UserError(f"{where}: half_extents are {extents!r:.60}, expected three numbers, as in [0.1, 0.1, 0.2]")
        x, y, z = (size({"half_extents": each}, "half_extents") for each in extents)
        return box((x, y, z))
    if kind == "sphere":
        return sphere(size(given, "radius"))
    if kind == "cylinder":
        return cylinder(size(given, "radius"), size(given, "length"))
    name = given["mesh"]
    if not isinstance(name, str) or not name.lower().endswith(".obj") or Path(name).name != name:
        raise UserError(f"{where}: mesh is {name!r:.60}, expected the name of an OBJ file in the folder")
    return mesh(folder / name)


def _check_names(names: list[str], path: Path) -> None:
    velocities = VELOCITIES if set(VELOCITIES) & set(names) else ()
    table.check_names(names, COLUMNS, ("episode", "t", *POSE, *velocities), path)


def _check_quaternions(columns: Mapping[str, np.ndarray], lines: np.ndarray, path: Path) -> None:
    norm = np.sqrt(sum(columns[name] ** 2 for name in POSE[3:]))
    wrong = np.flatnonzero(~(np.abs(norm - 1) <= UNIT))
    if len(wrong):
        k = wrong[0]
        raise UserError(
            f"{path}, line {lines[k]}: qx, qy, qz, qw have a norm of {norm[k]:.4g}, expected a unit quaternion"
        )


def _check_time(t: np.ndarray, lines: np.ndarray, sample_time: float, path: Path) -> None:
    steps = table.time_steps(t, lines, sample_time, path)
    uneven = np.flatnonzero(np.abs(steps / sample_time - 1) > STEP_TOLERANCE)
    if len(uneven):
        k = uneven[0]
        raise UserError(
            f"{path}, line {lines[k + 1]}: a step of {steps[k]:g} s, expected uniform steps of {sample_time:g} s"
        )


def _recording(
    nominal: dict[str, float],
    shape: Shape,
    sample_time: float,
    columns: Mapping[str, np.ndarray],
    episodes: Mapping[int, np.ndarray],
) -> ContactRecording:
    rows = list(episodes.values())

    def padded(names: tuple[str, ...]) -> np.ndarray:
        return table.padded(np.stack([columns[name] for name in names], axis=1), rows, np.nan)

    attitude = padded(POSE[3:])
    return ContactRecording(
        nominal=nominal,
        shape=shape,
        sample_time=sample_time,
        position=padded(POSE[:3]),
        attitude=attitude / np.linalg.norm(attitude, axis=2, keepdims=True),
        velocity=padded(VELOCITIES) if "vx" in columns else None,
        lengths=np.array([len(each) for each in rows], dtype=np.int64),
        episodes=tuple(episodes),
    )


def _check_length(recording: ContactRecording, hold_out: bool, path: Path) -> None:
    least = LEAST_EPISODE if hold_out else 2
    short = np.flatnonzero(recording.lengths < least)
    if len(short):
        k = short[0]
        count = f"{recording.lengths[k]} samples" if recording.lengths[k] > 1 else "one sample"
        raise UserError(f"{path}: episode {recording.episodes[k]} has {count}, expected at least {least}")
    if hold_out and len(recording) < LEAST_TOSSES:
        count = "one toss" if len(recording) == 1 else f"{len(recording)} tosses"
        raise UserError(f"{path}: {count}, expected at least {LEAST_TOSSES} to hold some out")
