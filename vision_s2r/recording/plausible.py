"""Whether a torque can be one: unsigned currents and goals stand in its place more often than not.

The torque balance is a regression over what a joint may feel: its acceleration, speed, direction, and its position, by
a load, a spring or a constant. It explains most of a real torque, and little of a current without a sign.
"""

from pathlib import Path

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.recording.data import JointRecording

REVERSALS = 3  # of motion, at least, before a sign that never changes says something
EXPLAINED = 0.7  # of the torque's variance that the balance explains where it is one
SMOOTH = 7  # samples over which motion is differentiated
FOLLOWS = 0.99  # correlation of a goal with the position
ONE_TO_ONE = (0.8, 1.25)  # slope between the two


def check(recording: JointRecording, column: str, path: Path) -> None:
    """UserError where the torque or current of a recording cannot be one, with the reason."""
    if recording.servo or int(recording.lengths.min()) < 2 * SMOOTH:
        return
    units = "A" if column == "current" else "N·m" if recording.units == "rotary" else "N"
    inside = np.isfinite(recording.position)
    command, position = recording.command[inside], recording.position[inside]
    if np.ptp(command) == 0 or np.ptp(position) == 0:
        return
    if _is_goal(command, position):
        raise UserError(
            f"{path}: {column} follows the position one to one: is it a goal? Expected {units}; "
            "a position servo's goals go into a column target, and its gains into control"
        )
    if (command >= 0).all() or (command <= 0).all():
        turns, explained = _balance(recording)
        if turns >= REVERSALS and explained < EXPLAINED:
            raise UserError(
                f"{path}: {column} never changes its sign while the joint reverses {turns} times: is it a current "
                f"without a sign? Expected {units} with the sign of the torque"
            )


def _is_goal(command: np.ndarray, position: np.ndarray) -> bool:
    slope, offset = np.polyfit(command, position, 1)
    left = np.std(position - slope * command - offset) / np.std(position)
    near = abs(position.mean() - command.mean()) < 0.25 * np.ptp(position)
    return bool(left < np.sqrt(1 - FOLLOWS**2) and ONE_TO_ONE[0] < slope < ONE_TO_ONE[1] and near)


def _balance(recording: JointRecording) -> tuple[int, float]:
    """How often the joint reverses, and which part of the command's variance a torque balance explains."""
    from scipy.signal import savgol_filter  # here: it takes half a second, and pictures need none of it

    columns, commands, turns = [], [], 0
    for position, command, length in zip(recording.position, recording.command, recording.lengths, strict=True):
        q = savgol_filter(position[:length], SMOOTH, 2)
        v = savgol_filter(position[:length], SMOOTH, 2, deriv=1)
        a = savgol_filter(position[:length], SMOOTH, 2, deriv=2)
        rest = 0.05 * np.abs(v).max()
        moving = v[np.abs(v) > rest]
        turns += int(np.sum(np.diff(np.sign(moving)) != 0))
        direction = np.where(np.abs(v) > rest, np.sign(v), 0.0)
        columns.append(np.stack([a, v, direction, np.ones(length), q, np.sin(q), np.cos(q)], axis=1))
        commands.append(command[:length])
    rows, torque = np.concatenate(columns), np.concatenate(commands)
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    found = np.linalg.lstsq(rows / size, torque, rcond=1e-9)[0]
    if found[0] < 0:  # more torque, less acceleration: no balance
        return turns, 0.0
    return turns, float(1 - np.var(torque - rows / size @ found) / np.var(torque))
