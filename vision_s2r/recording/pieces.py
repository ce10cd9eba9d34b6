"""An arm's recording without some of its rows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vision_s2r.recording.data import ArmRecording, JointRecording

Rows = Sequence[tuple[int, int, int]]  # of an episode (its index), first row, and the one behind the last; in order
SHORTEST = 0.5  # s, of what is left between rows that are left out
NEAR = 2  # rows to either side, that a velocity is read off


def without(recording: ArmRecording, rows: Rows) -> ArmRecording:
    """The recording without these rows, numbered from 0: each stretch between them is an episode of its own.

    It begins as fast as positions show. Stretches of less than SHORTEST are left out, too.
    """
    if not rows:
        return recording
    kept = _kept(recording.any, rows)
    return replace(
        recording,
        joints={name: _of_joint(joint, kept) for name, joint in recording.joints.items()},
        torque={name: _taken(values, kept, np.nan) for name, values in recording.torque.items()},
    )


def kept_rows(recording: ArmRecording, rows: Rows) -> int:
    """How many rows are left without these."""
    return sum(end - first for _, first, end in _kept(recording.any, rows))


def _kept(recording: JointRecording, rows: Rows) -> list[tuple[int, int, int]]:
    found = []
    for k, length in enumerate(recording.lengths):
        at = 0
        for _, first, end in (*(each for each in rows if each[0] == k), (k, int(length), int(length))):
            if first > at and recording.time[k, first - 1] - recording.time[k, at] >= SHORTEST:
                found.append((k, at, first))
            at = end
    return found


def _of_joint(joint: JointRecording, kept: Rows) -> JointRecording:
    lengths, of = np.array([end - first for _, first, end in kept]), np.array([k for k, _, _ in kept])
    times = None
    if joint.times is not None:
        times = _taken(joint.times, kept, 0.0)
        times -= times[:, :1]
        for row, length in zip(times, lengths, strict=True):  # it goes on after the end
            row[length:] = row[length - 1] + np.arange(1, len(row) - length + 1) * joint.sample_time
    return replace(
        joint,
        command=_taken(joint.command, kept, 0.0),
        position=_taken(joint.position, kept, np.nan),
        times=times,
        lengths=lengths,
        episodes=tuple(range(len(kept))),
        stretch_of=of,
        source=None if joint.source is None else joint.source[of],
        gains=None if joint.gains is None else joint.gains[of],
        start_velocity=np.array([_velocity(joint, k, first) for k, first, _ in kept]),
        velocity=None if joint.velocity is None else _taken(joint.velocity, kept, np.nan),
        supply=None if joint.supply is None else _taken(joint.supply, kept, 1.0),
    )


def _velocity(joint: JointRecording, k: int, row: int) -> float:
    """At a row of an episode, by a straight line through the rows about it; of its first row what the recording has."""
    if row == 0:
        return float(joint.first[k, 1])
    near = slice(max(row - NEAR, 0), min(row + NEAR + 1, int(joint.lengths[k])))
    return float(np.polyfit(joint.time[k, near], joint.position[k, near], 1)[0])


def _taken(values: np.ndarray, kept: Rows, fill: float) -> np.ndarray:
    """Values [E, T] of these rows; `fill` after the end."""
    longest = max(end - first for _, first, end in kept)
    out = np.full((len(kept), longest), fill)
    for row, (k, first, end) in zip(out, kept, strict=True):
        row[: end - first] = values[k, first:end]
    return out
