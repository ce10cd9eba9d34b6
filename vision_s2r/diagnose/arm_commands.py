"""What to record next of an arm: its joints' experiments, as goals that keep the tip where nothing is in its way."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from vision_s2r.arm.model import opened
from vision_s2r.diagnose.one_case import Diagnosis
from vision_s2r.fit.arm.free_run import heights
from vision_s2r.recording import ArmRecording, JointRecording

GRID = 100  # postures on a joint's way, of which is asked how high the tip is
FURTHEST = 7.0  # rad or m from where a joint rests


def commands(parts: Mapping[str, Diagnosis], recording: ArmRecording) -> dict[str, np.ndarray]:
    """The experiments of all joints, one after the other, while the others are asked to stay.

    Goals are within the limits that the model has for a joint, wherever the log's own were, and where the tip is no
    lower than it has been: what is below that nobody knows.
    """
    room = _Room(recording, parts)
    columns: dict[str, list[np.ndarray]] = {}
    count = 0
    for name, part in parts.items():
        if not part.experiment.commands:
            continue
        episode, t, command = part.experiment.commands.values()
        if recording.modes[name] == "position":
            command = command.clip(*room.goals(name))
        held = {f"command.{other}": np.full(len(t), value) for other, value in room.rest.items()}
        for key, values in ({"episode": episode + count, "t": t} | held | {f"command.{name}": command}).items():
            columns.setdefault(key, []).append(values)
        count += int(episode[-1]) + 1
    return {key: np.concatenate(values) for key, values in columns.items()}


class _Room:
    """Where the joints of an arm may be asked to go."""

    def __init__(self, recording: ArmRecording, parts: Mapping[str, Diagnosis]) -> None:
        self._recording, self._parts = recording, parts
        measured = heights(recording, recording.position)
        self._lowest = -np.inf if measured is None or not recording.by_goals else float(np.nanmin(measured))

    @cached_property
    def rest(self) -> dict[str, float]:
        """Where joints stay: midway between their commands, or where the arm was nearest to that."""
        middle = {}
        for name, part in self._parts.items():
            assert isinstance(part.recording, JointRecording)
            middle[name] = 0.5 * (np.nanmin(part.recording.command) + np.nanmax(part.recording.command))
        postures = np.array([*middle.values()])[None]
        if self._free(postures)[0]:
            return middle
        been = self._recording.position[np.isfinite(self._recording.position).all(axis=-1)]
        far = np.linalg.norm((been - postures) / np.maximum(np.ptp(been, axis=0), 1e-9), axis=1)
        return dict(zip(middle, map(float, been[far.argmin()]), strict=True))

    def goals(self, joint: str) -> tuple[float, float]:
        """The lowest and the highest that a joint may be given while all others rest (rad, m)."""
        known, here = opened(self._recording.model).joints[joint], self.rest[joint]
        low, high = (
            self._reached(joint, float(np.clip(here + way, known.low, known.high))) for way in (-FURTHEST, FURTHEST)
        )
        return low, high

    def _reached(self, joint: str, end: float) -> float:
        """How far a joint may go from where it rests towards an end."""
        postures = np.tile([*self.rest.values()], (GRID, 1))
        way = postures[:, [*self.rest].index(joint)] = np.linspace(self.rest[joint], end, GRID)
        blocked = np.flatnonzero(~self._free(postures))
        return float(way[max(blocked[0] - 1, 0) if len(blocked) else -1])

    def _free(self, postures: np.ndarray) -> np.ndarray:
        """Whether the tip is as high as it has been at least, at postures [N, J]."""
        found = heights(self._recording, postures)
        return np.full(len(postures), True) if found is None else found >= self._lowest
