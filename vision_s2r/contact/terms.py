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
FIELD = 5  # of a field over the support beside what it is in the middle: x, y and their products
SIDEWAYS = 2  # of a force of speed: in x and in y, proportional to the speed
# Rows of the terms' array.
_HEIGHT, _PLACE, _SPEED, _TIME, _DIRECTION, _AREA, _SLIDING, _AGE = range(8)
_FORCES = 4  # rows of forces; the others are of the friction


@dataclass(frozen=True)
class Terms:
    """Which terms a machine's row carries behind COLUMNS, in this order.

    Accelerations, in m/s²:
    height: knots of an upward one over the height of the lowest point, at 0, s, 3·s, 7·s, 15·s … (s, count).
    place: in x and in y, that change over x and y, about this point (x, y) in m: what they are there, and of second
    order.
    speed: knots of one against the motion, over the speed, evenly up to (m/s, count), nothing at rest; and two in x and
    y at that speed, which grow with it.
    time: knots in x, y and z over the time since the start of the episode, evenly up to (s, count).

    And by how much the coefficient of friction is larger, relative to it; what it is in any case goes before the rest:
    direction: harmonics over the direction of sliding.
    area: as place, of where the body is.
    sliding: knots over the speed of sliding, evenly up to (m/s, count), the first at 0 not counted.
    age: likewise over the time since the start of the episode (s, count).
    """

    height: tuple[float, int] | None = None
    place: tuple[float, float] | None = None
    speed: tuple[float, int] | None = None
    time: tuple[float, int] | None = None
    direction: bool = False
    area: tuple[float, float] | None = None
    sliding: tuple[float, int] | None = None
    age: tuple[float, int] | None = None

    @property
    def width(self) -> int:
        """How many coefficients a machine's row carries."""
        return int(self.array()[:, 2].sum())

    def array(self) -> np.ndarray:
        """[8, 3] float64, a row a term: two numbers of its own, and its coefficients; 0 where there is none."""
        out = np.zeros((8, 3))
        for row, knots, each, more in (
            (_HEIGHT, self.height, 1, 0),
            (_SPEED, self.speed, 1, SIDEWAYS),
            (_TIME, self.time, AXES, 0),
            (_SLIDING, self.sliding, 1, 0),
            (_AGE, self.age, 1, 0),
        ):
            if knots is None:
                continue
            span, count = knots
            if count < 2 or not span > 0:
                raise UserError(f"term of {count} knots over {span:g}: expected 2 or more, over more than 0")
            out[row] = span, count, each * count + more
        for row, middle, fields in ((_PLACE, self.place, 2), (_AREA, self.area, 1)):
            if middle is not None:
                out[row] = *middle, fields * (1 + FIELD)
        if self.direction:
            out[_DIRECTION, 2] = 1 + HARMONICS
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
    if terms[_HEIGHT, 2] > 0:
        z += _between(heights, first, 1, int(terms[_HEIGHT, 1]), math.log2(1 + max(gap, 0.0) / terms[_HEIGHT, 0]))
        first += int(terms[_HEIGHT, 2])
    if terms[_PLACE, 2] > 0:
        east, north = position[0] - terms[_PLACE, 0], position[1] - terms[_PLACE, 1]
        x += _field(heights, first, east, north)
        y += _field(heights, first + 1 + FIELD, east, north)
        first += 2 * (1 + FIELD)
    if terms[_SPEED, 2] > 0:
        count = int(terms[_SPEED, 1])
        speed = math.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1] + velocity[2] * velocity[2]) + 1e-9
        share = speed / terms[_SPEED, 0]
        drag = _between(heights, first, 1, count, share * (count - 1)) * min(1.0, share * (count - 1)) / speed
        x += heights[first + count] * share - drag * velocity[0]
        y += heights[first + count + 1] * share - drag * velocity[1]
        z -= drag * velocity[2]
        first += int(terms[_SPEED, 2])
    if terms[_TIME, 2] > 0:
        count = int(terms[_TIME, 1])
        place = time / terms[_TIME, 0] * (count - 1)
        x += _between(heights, first, AXES, count, place)
        y += _between(heights, first + 1, AXES, count, place)
        z += _between(heights, first + 2, AXES, count, place)
    return x, y, z


@compiled
def varying(terms: np.ndarray) -> bool:
    """Whether anything depends on time."""
    return bool(terms[_TIME, 2] + terms[_AGE, 2] > 0)


@compiled
def friction_of(
    terms: np.ndarray, heights: np.ndarray, friction: Lanes, position: Vector, x: Lanes, y: Lanes, time: Lanes
) -> Lanes:
    """The coefficient of friction of a body at `position` for a point that slides with velocity (x, y)."""
    first = len(heights)
    for row in range(_FORCES, len(terms)):
        first -= int(terms[row, 2])
    if first == len(heights):
        return friction
    change = everywhere(0.0)
    square = x * x + y * y
    if terms[_DIRECTION, 2] > 0:
        size = math.sqrt(square)
        c, s = x / size, y / size
        turned = heights[first + 1] * c + heights[first + 2] * s
        turned += heights[first + 3] * (c * c - s * s) + heights[first + 4] * 2 * c * s
        change += heights[first] + where(square < 1e-16, 0.0, turned)
        first += 1 + HARMONICS
    if terms[_AREA, 2] > 0:
        change += _field(heights, first, position[0] - terms[_AREA, 0], position[1] - terms[_AREA, 1])
        first += 1 + FIELD
    if terms[_SLIDING, 2] > 0:
        change += _since(heights, first, int(terms[_SLIDING, 1]), math.sqrt(square) / terms[_SLIDING, 0])
        first += int(terms[_SLIDING, 2])
    if terms[_AGE, 2] > 0:
        change += _since(heights, first, int(terms[_AGE, 1]), time / terms[_AGE, 0])
    return friction * max(0.0, 1 + change)


@compiled
def _field(heights: np.ndarray, first: int, east: Lanes, north: Lanes) -> Lanes:
    """A field over the support, of second order."""
    of_east = heights[first + 1] + heights[first + 3] * east + heights[first + 4] * north
    return heights[first] + of_east * east + (heights[first + 2] + heights[first + 5] * north) * north


@compiled
def _since(heights: np.ndarray, first: int, count: int, share: Lanes) -> Lanes:
    """What it is in any case, and piecewise-linear through 0 and the knots that follow."""
    place = share * (count - 1)  # nothing is below 0
    return min(place, 1.0) * heights[first] + _between(heights, first, 1, count, place)
