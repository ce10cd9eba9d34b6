"""Torques that no effect of the library is: piecewise-linear, with free heights.

They depend on position, velocity, time, or on the torque that the drive is to give.

The diagnosis fits them to tell an effect of the library from a coincidence of several that mimics an unknown one.
"""

import math
from dataclasses import dataclass

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.joint.compiled import compiled

Knots = tuple[float, float, int]


@dataclass(frozen=True)
class Tables:
    """Where the knots of the added torques lie: (low, high, count) in the variable, evenly spaced; None: no table.

    Position and velocity are the motor's where play or a spring divides it from the load. Beyond the ends the torque
    stays what it is there. The torques at the knots are part of each machine's row, behind COLUMNS: the heights over
    position, then over velocity, over time and over the drive's torque as it is to be. That one's knots lie evenly in
    the torque's root with its sign: closer together about 0, where drives are least proportional.
    """

    position: Knots | None = None  # rad
    velocity: Knots | None = None  # rad/s
    time: Knots | None = None  # s from the start of the episode
    torque: Knots | None = None  # root of N·m or N, with a sign

    @property
    def _all(self) -> tuple[Knots | None, ...]:
        return self.position, self.velocity, self.time, self.torque

    @property
    def width(self) -> int:
        """How many heights a machine's row carries."""
        return sum(knots[2] for knots in self._all if knots)

    def array(self) -> np.ndarray:
        """[4, 3] float64: low, knots per unit, count of each table; count 0 where there is none."""
        out = np.zeros((len(self._all), 3))
        for row, knots in zip(out, self._all, strict=True):
            if knots is None:
                continue
            low, high, count = knots
            if count < 2 or not high > low:
                raise UserError(f"table of {count} knots from {low:g} to {high:g}: expected 2 or more, upwards")
            row[:] = low, (count - 1) / (high - low), count
        return out


@compiled
def look_up(tables: np.ndarray, heights: np.ndarray, position: float, velocity: float, time: float) -> float:
    """Sum of the torques over position, velocity and time."""
    if len(heights) == 0:
        return 0.0
    torque, first = 0.0, 0
    for k in range(3):
        value = position if k == 0 else velocity if k == 1 else time
        torque += _torque_at(tables[k], heights, first, value)
        first += int(tables[k, 2])
    return torque


@compiled
def look_up_drive(tables: np.ndarray, heights: np.ndarray, torque: float) -> float:
    """What the drive gives beside the torque that it is to give."""
    count = int(tables[3, 2])
    if len(heights) == 0 or count == 0:
        return 0.0
    return _torque_at(tables[3], heights, len(heights) - count, math.copysign(math.sqrt(abs(torque)), torque))


@compiled
def _torque_at(table: np.ndarray, heights: np.ndarray, first: int, value: float) -> float:
    count = int(table[2])
    if count == 0:
        return 0.0
    place = (value - table[0]) * table[1]
    place = min(place, count - 1.0) if place > 0 else 0.0
    left = min(int(place), count - 2)
    share = place - left
    return heights[first + left] * (1 - share) + heights[first + left + 1] * share
