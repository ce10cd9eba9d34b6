"""Recordings of a whole machine: a folder of recordings of its parts, and how its task went."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias, cast

import numpy as np

from vision_s2r.errors import UserError, check_keys
from vision_s2r.recording import header, table
from vision_s2r.recording.data import CameraRecording, ContactRecording, JointRecording
from vision_s2r.recording.read import read

KEYS = ("format", "kind", "parts")
Part: TypeAlias = JointRecording | CameraRecording | ContactRecording
KINDS = {"camera": "camera", "joints": "joint", "contact": "contact"}  # of each part's recording
COLUMNS = ("episode", "success")


@dataclass(frozen=True)
class RobotRecording:
    """The parts of one machine that were recorded."""

    parts: Mapping[str, Part]  # by their folder's path in the robot's: camera, joints/a, joints/b, contact
    success: np.ndarray | None  # bool [episodes] of the task, where outcomes.csv says

    kind = "robot"


def is_robot(folder: Path | str) -> bool:
    """Whether a folder is the recording of a robot. Raises UserError where it is none at all."""
    return header.load(Path(folder)).get("kind") == RobotRecording.kind


def read_robot(folder: Path | str) -> RobotRecording:
    """The recordings of a robot's folder, each checked. Raises UserError, one line, for whatever cannot be."""
    folder = Path(folder)
    content, where = header.load(folder), str(folder / "recording.yaml")
    header.choice(content, "kind", (RobotRecording.kind,), where)
    check_keys(content, KEYS, where, ("parts",))
    given = header.mapping(content, "parts", where)
    check_keys(given, KINDS, f"{where}: parts")
    if not given:
        raise UserError(f"{where}: parts are none, expected at least one of {', '.join(KINDS)}")
    parts: dict[str, Part] = {}
    for part, named in given.items():
        names = named if part == "joints" else [named]
        if not isinstance(names, list) or not names or not all(isinstance(name, str) and name for name in names):
            wanted = "a list of folders, as in [joints/a, joints/b]" if part == "joints" else "a folder"
            raise UserError(f"{where}: parts: {part} is {named!r:.60}, expected {wanted}")
        for name in names:
            if name in parts:
                raise UserError(f"{where}: parts: '{name}' is there twice, expected each folder once")
            parts[name] = _part(folder, name, part, where)
    return RobotRecording(parts, _outcomes(folder / "outcomes.csv"))


def _part(folder: Path, name: str, part: str, where: str) -> Part:
    if "\0" in name:
        raise UserError(f"{where}: parts: {part} is {name!r:.60}, expected a folder")
    path = folder / name
    if Path(name).is_absolute() or not path.resolve().is_relative_to(folder.resolve()) or path.resolve() == folder:
        raise UserError(f"{where}: parts: {part} is '{name:.60}', expected a folder inside the robot's")
    kind = header.load(path).get("kind")
    if kind != KINDS[part]:
        raise UserError(f"{path / 'recording.yaml'}: kind is {kind!r:.40}, but {part} of the robot are '{KINDS[part]}'")
    return cast(Part, read(path))


def _outcomes(path: Path) -> np.ndarray | None:
    if not path.exists():
        return None
    columns, lines = table.columns(path, _check_names)
    rows = table.episodes(columns["episode"], lines, path)
    for episode, at in rows.items():
        if len(at) > 1:
            raise UserError(
                f"{path}, line {lines[at[1]]}: episode {episode} is there twice, expected one row an episode"
            )
    wrong = np.flatnonzero(~np.isin(columns["success"], (0, 1)))
    if len(wrong):
        value = columns["success"][wrong[0]]
        raise UserError(f"{path}, line {lines[wrong[0]]}: success is {value:g}, expected 0 or 1")
    return columns["success"] == 1


def _check_names(names: list[str], path: Path) -> None:
    if sorted(names) != sorted(COLUMNS):
        raise UserError(f"{path}: columns are {', '.join(names)[:80]}, expected {', '.join(COLUMNS)}")
