"""Discrepancy terms: forces and a friction that no effect of the library is, with free coefficients.

The diagnosis fits them to tell an effect of the library from a coincidence of several that mimics an unknown one.
"""

import math
from dataclasses import dataclass

import numpy as np

from vision_s2r.contact.lanes import Lanes, everywhere, where
from vision_s2r.contact.vectors import Vector
from vision_s2r.errors import UserError
from vision_s2r.joint.compiled import compiled

AXES = 3
HARMONICS = 4  # coefficients of a friction of direction: cos, sin of the angle, and of twice the angle
FIELD = 4  # of a force of place: its change with x and y, in x and in y
SIDEWAYS = 2  # of a force of speed: in x and in y, proportional to the speed


@dataclass(frozen=True)
class Terms:
    """Which terms a machine's row carries behind COLUMNS, in this order; accelerations, in m/s².

    height: knots of an upward acceleration over the height of the lowest point, at 0, s, 3·s, 7·s, 15·s … (s, count).
    place: accelerations in x and y that change linearly with x and y, from this point (x, y) in m.
    speed: knots of an acceleration against the motion, over the speed, evenly up to (m/s, count), nothing at rest; and
    two accelerations in x and y at that speed, which grow with it.
    time: knots of an acceleration in x, y and z over the time since the start of the episode, evenly up to (s, count).
    direction: harmonics of the friction's coefficient over the direction of sliding, relative to it.
    """

    height: tuple[float, int] | None = None
    place: tuple[float, float] | None = None
    speed: tuple[float, int] | None = None
    time: tuple[float, int] | None = None
    direction: bool = False

    @property
    def width(self) -> int:
        """How many coefficients a machine's row carries."""
        return int(self.array()[:, 2].sum())

    def array(self) -> np.ndarray:
        """[5, 3] float64, a row a term: two numbers of its own, and its coefficients; 0 where there is none."""
        out = np.zeros((5, 3))
        for row, knots, each, more in ((0, self.height, 1, 0), (2, self.speed, 1, SIDEWAYS), (3, self.time, AXES, 0)):
            if knots is None:
                continue
            span, count = knots
            if count < 2 or not span > 0:
                raise UserError(f"term of {count} knots over {span:g}: expected 2 or more, over more than 0")
            out[row] = span, count, each * count + more
        if self.place is not None:
            out[1] = *self.place, FIELD
        if self.direction:
            out[4, 2] = HARMONICS
        return out


NO_TERMS = Terms()


@compiled
def _between(heights: np.ndarray, first: int, stride: int, count: int, place: Lanes) -> Lanes:
    """Piecewise-linear through the knots heights[first + k·stride], beyond the ends what it is there."""
    place = min(max(place, 0.0), count - 1.0)
    value = heights[first] + place * (heights[first + stride] - heights[first])
    for k in range(1, count - 1):
        left = heights[first + k * stride]
        value = where(place >= k, left + (place - k) * (heights[first + (k + 1) * stride] - left), value)
    return value


@compiled
def acceleration(
    terms: np.ndarray, heights: np.ndarray, position: Vector, velocity: Vector, gap: Lanes, time: Lanes
) -> Vector:
    """Sum of the terms' accelerations; `gap` is the height of the lowest point."""
    x = y = z = everywhere(0.0)
    first = 0
    if terms[0, 2] > 0:
        z += _between(heights, first, 1, int(terms[0, 1]), math.log2(1 + max(gap, 0.0) / terms[0, 0]))
        first += int(terms[0, 2])
    if terms[1, 2] > 0:
        east, north = position[0] - terms[1, 0], position[1] - terms[1, 1]
        x += heights[first] * east + heights[first + 1] * north
        y += heights[first + 2] * east + heights[first + 3] * north
        first += FIELD
    if terms[2, 2] > 0:
        count = int(terms[2, 1])
        speed = math.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2]) + 1e-9
        share = speed / terms[2, 0]
        drag = _between(heights, first, 1, count, share * (count - 1)) * min(1.0, share * (count - 1)) / speed
        x += heights[first + count] * share - drag * velocity[0]
        y += heights[first + count + 1] * share - drag * velocity[1]
        z -= drag * velocity[2]
        first += int(terms[2, 2])
    if terms[3, 2] > 0:
        count = int(terms[3, 1])
        place = time / terms[3, 0] * (count - 1)
        x += _between(heights, first, AXES, count, place)
        y += _between(heights, first + 1, AXES, count, place)
        z += _between(heights, first + 2, AXES, count, place)
    return x, y, z


@compiled
def directed(terms: np.ndarray, heights: np.ndarray, friction: Lanes, x: Lanes, y: Lanes) -> Lanes:
    """The coefficient of friction for sliding towards (x, y)."""
    if terms[4, 2] == 0:
        return friction
    square = x * x + y * y
    size = math.sqrt(square)
    c, s = x / size, y / size
    first = len(heights) - HARMONICS
    change = heights[first] * c + heights[first + 1] * s
    change += heights[first + 2] * (c * c - s * s) + heights[first + 3] * 2 * c * s
    return where(square < 1e-16, friction, friction * max(0.0, 1 + change))
