"""Torques that no effect of the library is: piecewise-linear in position, velocity or time, with free heights.

The diagnosis fits them to tell an effect of the library from a coincidence of several that mimics an unknown one.
"""

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
    position, then over velocity, then over time.
    """

    position: Knots | None = None  # rad
    velocity: Knots | None = None  # rad/s
    time: Knots | None = None  # s from the start of the episode

    @property
    def width(self) -> int:
        """How many heights a machine's row carries."""
        return sum(knots[2] for knots in (self.position, self.velocity, self.time) if knots)

    def array(self) -> np.ndarray:
        """[3, 3] float64: low, knots per unit, count of each table; count 0 where there is none."""
        out = np.zeros((3, 3))
        for row, knots in zip(out, (self.position, self.velocity, self.time), strict=True):
            if knots is None:
                continue
            low, high, count = knots
            if count < 2 or not high > low:
                raise UserError(f"table of {count} knots from {low:g} to {high:g}: expected 2 or more, upwards")
            row[:] = low, (count - 1) / (high - low), count
        return out


@compiled
def look_up(tables: np.ndarray, heights: np.ndarray, position: float, velocity: float, time: float) -> float:
    """Sum of the tables' torques."""
    if len(heights) == 0:
        return 0.0
    torque = 0.0
    first = 0
    for k in range(3):
        count = int(tables[k, 2])
        if count == 0:
            continue
        value = position if k == 0 else velocity if k == 1 else time
        place = (value - tables[k, 0]) * tables[k, 1]
        place = min(place, count - 1.0) if place > 0 else 0.0
        left = min(int(place), count - 2)
        share = place - left
        torque += heights[first + left] * (1 - share) + heights[first + left + 1] * share
        first += count
    return torque
