"""The arm's drives: what becomes of commanded joint positions on a machine that has effects.

Every drive is a position servo of `vision_s2r.joint`. Its tool is displaced by the difference between the servo with
its effects and the nominal one under the same commands: a nominal drive does what it is told, so that a machine
without effects is the scene's own arm, to the bit. What the gripper touches does not push back on the drives' model.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vision_s2r.joint import COLUMNS, NominalJoint, pack, simulate
from vision_s2r.scene.machine import DRIVES, Values

# What the simulator believes of each drive; rad, or m for the lift, whose weight is balanced.
NOMINAL = {
    "shoulder": NominalJoint(1.0, 0.3, 0.5, 0.3, proportional_gain=300.0, derivative_gain=17.0, command_limit=40.0),
    "elbow": NominalJoint(1.0, 0.08, 0.15, 0.1, proportional_gain=100.0, derivative_gain=5.0, command_limit=15.0),
    "lift": NominalJoint(1.0, 1.0, 4.0, 1.0, proportional_gain=2000.0, derivative_gain=80.0, command_limit=60.0),
    "wrist": NominalJoint(1.0, 0.004, 0.01, 0.01, proportional_gain=8.0, derivative_gain=0.3, command_limit=2.0),
}
LIFT = DRIVES.index("lift")
_OFFSET = COLUMNS.index("position_offset")
APPROACH = 1.0  # s from where the arm waits to over the grasp
LONGEST = 1.6  # s that a controller waits for drives to arrive, at most
ARRIVED = 0.002  # rad, or m: as near to where they come to rest
STROKE = 0.12  # m by which the lift moves down to a grasp, and up again
ROUNDS = 3  # of correcting a command for the displacement of the one before


@dataclass(frozen=True)
class Tuning:
    """A controller that knows drives: it commands what brings them to where they are wanted, and waits until they are.

    Of several beliefs it corrects for the mean displacement, and waits for the slowest. None: it commands the place
    itself, and does not wait. What turns slowly is waited for over the grasp alone, where nothing is touched.
    """

    believed: tuple[Mapping[str, Values], ...] = ()  # effects by drive, of one belief each

    def __bool__(self) -> bool:
        return any(self.believed)

    def correction(self, waiting: np.ndarray, goal: np.ndarray, time_step: float) -> tuple[np.ndarray, int, int]:
        """What to add [4] to the commands of a goal [4], and time steps to wait: over it, and after each stroke."""
        correction, over, after = np.zeros(4), 0, 0
        if not self:
            return correction, over, after
        hold = round(LONGEST / time_step)
        for _ in range(ROUNDS):
            held = np.tile(goal + correction, (hold, 1))
            raised = held.copy()
            raised[:, LIFT] += STROKE
            ways, strokes = [], []
            for effects in self.believed:
                drives = Drives(effects, time_step, waiting)
                drives.approach(goal + correction)
                ways.append(drives.plan(held))
                drives.commit(held)
                strokes.append(drives.plan(raised)[:, [LIFT]])
            far = np.stack(ways)  # [B, hold, 4]
            correction = -far[:, -1].mean(axis=0)
            over, after = _settled(far), _settled(np.stack(strokes))
        return correction, over, after


def _settled(displaced: np.ndarray) -> int:
    """Time steps until all of [B, T, N] are where they end."""
    away = (np.abs(displaced - displaced[:, -1:]) > ARRIVED).any(axis=(0, 2))
    return int(np.flatnonzero(away).max(initial=-1)) + 1


class Drives:
    """The four drives of one attempt, from where the arm waits; commands are positions [n, 4], one row a time step."""

    def __init__(self, effects: Mapping[str, Values], time_step: float, waiting: np.ndarray) -> None:
        self._time_step = time_step
        self._sent = np.asarray(waiting, dtype=float)[None]  # [T, 4] since the beginning
        self.displaced = np.zeros(4)  # at the end of the approach
        self._machines = {
            k: np.stack([pack(NOMINAL[name], values), pack(NOMINAL[name], {})])
            for k, name in enumerate(DRIVES)
            if (values := effects.get(name))
        }

    def approach(self, goal: np.ndarray, wait: int = 0) -> np.ndarray:
        """Command the way to a goal [4], slow at both ends, and wait there; the displacement [4] at the end."""
        share = np.linspace(0, 1, round(APPROACH / self._time_step))[1:, None]
        smooth = share**3 * (10 - 15 * share + 6 * share**2)
        way = np.concatenate([self._sent[-1] + smooth * (goal - self._sent[-1]), np.tile(goal, (wait, 1))])
        self.displaced = self.plan(way)[-1]
        self.commit(way)
        return self.displaced

    def plan(self, commands: np.ndarray) -> np.ndarray:
        """By how much [n, 4] joints will be displaced from these commands, one time step after each."""
        out = np.zeros(commands.shape)
        whole = np.concatenate([self._sent, commands, commands[-1:]])  # the last is held while it acts
        for k, machines in self._machines.items():
            first = np.array([[whole[0, k], 0.0]])
            states = simulate(machines, whole[None, :, k], first, self._time_step, threads=1)
            there = states[:, 0, :, 0] - machines[:, [_OFFSET]]  # encoders show more by their offset
            out[:, k] = (there[0] - there[1])[-len(commands) :]
        return out

    def commit(self, commands: np.ndarray) -> None:
        """These commands [n, 4] were given."""
        self._sent = np.concatenate([self._sent, commands])
