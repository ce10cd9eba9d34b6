"""Stairs: a joint that stands still while its simulator moves, and then catches up at once.

A static friction above that in motion does so, and when a joint lets go is next to chance: a free run that has the
friction slips at other instants and is further off than one without, so that no likelihood finds it. Its signature is
read off the positions instead (Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30, 1994, on stick-slip).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.joint.track import fast_noise
from vision_s2r.recording import JointRecording

WINDOW = 0.15  # s, over which a joint stands still, or has jumped
FAR = 3.0  # steps of what is still, that a motion goes
FASTER = 2.0  # times the simulator's way, that a jump goes
LEAST, OFTEN = 8, 0.25  # slips, and of the times that it stood still


@dataclass(frozen=True)
class StickSlip:
    """How a joint sticks and slips."""

    count: int  # slips
    rest: float  # s that it stands still before one, the median
    jump: float  # rad or m, the median

    def described(self, unit: str) -> str:
        """In words, `unit` being that of positions."""
        return (
            f"a joint that sticks and slips ({self.count} times it stands still for about {self.rest:.2g} s and then "
            f"jumps by about {self.jump:.2g} {unit}), as under a friction at rest above that in motion"
        )


def stick_slip(recording: JointRecording, simulated: np.ndarray, resolution: float) -> StickSlip | None:
    """Of a joint beside simulated positions [E, T] (rad or m); None where it moves as smoothly as they do.

    `resolution`: of the encoder, 0 where it is not known.
    """
    still = max(1.5 * resolution, 4 * fast_noise(recording.position))
    found = [slip for k in range(len(recording.lengths)) for slip in _stalls(recording, simulated, k, still)]
    slips = np.array([(rest, jump) for rest, jump, slipped in found if slipped])
    if len(slips) < LEAST or len(slips) < OFTEN * len(found):
        return None
    rest, jump = np.median(slips, axis=0)
    return StickSlip(len(slips), float(rest), float(jump))


def _stalls(
    recording: JointRecording, simulated: np.ndarray, k: int, still: float
) -> Iterator[tuple[float, float, bool]]:
    """Each time that an episode's joint stands still in motion: for how long, how far it goes then, and if that is a
    slip."""
    length = int(recording.lengths[k])
    real, virtual, t = recording.position[k, :length], simulated[k, :length], recording.time[k, :length]
    window = max(round(WINDOW / recording.sample_time), 2)
    if length <= 2 * window:
        return
    way, there = real[window:] - real[:-window], virtual[window:] - virtual[:-window]
    stalled = np.concatenate([[False], (np.abs(way) <= still) & (np.abs(there) > FAR * still), [False]])
    starts, ends = (np.flatnonzero(np.diff(stalled.astype(int)) == sign) for sign in (1, -1))
    for start, end in zip(starts, ends, strict=True):
        last = end - 1 + window  # row at which it still is where it was
        if last + window >= length:
            continue
        direction = np.sign(there[start])
        jump, moved = direction * (real[last + window] - real[last]), abs(virtual[last + window] - virtual[last])
        yield float(t[last] - t[start]), float(jump), bool(jump > max(FASTER * moved, FAR * still))
