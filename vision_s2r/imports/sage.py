"""SAGE's motion folders (github.com/isaac-sim2real/sage): control.csv, state_motor.csv, joint_list.txt."""

import csv
import json
from pathlib import Path

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.imports.table import ImportOptions, JointTable

MICROSECONDS = 1e-6
UNSIGNED = "an unsigned current times a constant, no torque"


def load(path: Path, options: ImportOptions) -> list[JointTable]:
    """The joints of a motion, or of each motion in a folder. Raises UserError where there is none."""
    motions = [path] if (path / "control.csv").is_file() else sorted(p.parent for p in path.glob("*/control.csv"))
    if not motions:
        raise UserError(f"{path}: no control.csv in it or in its folders, expected SAGE's motions")
    tables = [table for motion in motions for table in _motion(motion)]
    prefix = len(motions) > 1
    return tables if prefix else [_renamed(table) for table in tables]


def _renamed(table: JointTable) -> JointTable:
    return JointTable(
        table.name.split("/")[-1], table.columns, table.drive, left_out=table.left_out, missing=table.missing
    )


def _motion(folder: Path) -> list[JointTable]:
    try:
        names = (folder / "joint_list.txt").read_text().split()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{folder / 'joint_list.txt'}: cannot be read ({error})") from error
    asked_at, goals = _rows(folder / "control.csv", "positions", len(names))
    at, positions = _rows(folder / "state_motor.csv", "positions", len(names))
    _, speeds = _rows(folder / "state_motor.csv", "velocities", len(names))
    _, torques = _rows(folder / "state_motor.csv", "torques", len(names))
    held = np.searchsorted(asked_at, at, side="right") - 1  # the goal that was the last
    first = int(np.argmax(held >= 0))
    t = (at[first:] - at[first]) * MICROSECONDS
    tables = []
    for k, name in enumerate(names):
        columns = {
            "episode": np.zeros(len(t)),
            "t": t,
            "target": goals[held[first:], k],
            "position": positions[first:, k],
            "velocity": speeds[first:, k],
        }
        left_out = {"torques": UNSIGNED} if (torques[:, k] >= 0).all() else {"torques": "a servo's torque is its law's"}
        tables.append(JointTable(f"{folder.name}/{name}", columns, "sts3215", left_out=left_out, missing=("supply",)))
    return tables


def _rows(path: Path, column: str, joints: int) -> tuple[np.ndarray, np.ndarray]:
    """Stamps [N] (µs) and values [N, joints] of a column of lists."""
    try:
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        stamps = np.array([float(row["timestamp"]) for row in rows])
        values = np.array([json.loads(row[column]) for row in rows], float)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError, csv.Error) as error:
        raise UserError(
            f"{path}: {error} is wrong or missing, expected timestamp and {column} as SAGE has them"
        ) from error
    if values.shape != (len(stamps), joints) or not len(stamps):
        raise UserError(
            f"{path}: {column} are {values.shape}, expected rows of {joints}, one a joint of joint_list.txt"
        )
    return stamps, values
