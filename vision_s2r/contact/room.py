"""What lanes hold: a machine and a body each, its points, and how far its motion has come."""

import math
from typing import NamedTuple

import numpy as np

from vision_s2r.contact.effects.support_tilt import tilted_gravity
from vision_s2r.contact.lanes import LANES, zeros
from vision_s2r.contact.machine import COLUMNS
from vision_s2r.contact.points import Numbers
from vision_s2r.joint.compiled import compiled

STATE = 13  # position, attitude (x, y, z, w), velocity, spin

# Rows of `given`: the first state of a lane's body, then
START_TIME = 13  # s since the episode began
TAKEN = 14  # 1 where the lane has a body
ROUNDING = 15  # m, of its points
PIECES = 16  # into which a step near the support is divided
GRAVITY = 17  # x, y and z
GIVEN = 20
# Rows of `shown`: the state at a sample, then
SAMPLE = 13  # which it is
SHOWN = 14
# Columns of `points`, a row a point of the body.
START, END = 0, 1  # heights before and after a try
ACTIVE = 2  # 1 where it touches in the middle
KEPT = 3  # x, y and z: the impulse of when it was last listed in `touch`
POINTS_WIDTH = 6
# Columns of `touch`: a lane's points that touch, in its first rows.
POINT = 0  # which of the body's points; -1 for none
CORNER = 1  # its place in the frame of the points: x, y and z
IMPULSE = 4  # x, y and z: of the last solution, where the next begins
X, Y, Z = 7, 8, 9  # from the centre of mass, in the world's frame
LEVERS = 10  # change of spin by a unit impulse along x, y and z: nine numbers
UPWARD, ACROSS = 19, 20  # impulse for a unit change of the point's velocity: along the normal, and at least across it
TARGET = 21  # normal velocity that a rigid point keeps at least; depth of a spring's
BEFORE = 22  # normal velocity before
FRICTION = 23  # coefficient
PUSHED = 24  # change of the point's velocity along x and y by a unit impulse along z
TOUCH_WIDTH = 26

PHASE = 0.3  # of a contact spring's oscillation, in rad, that a step goes through at most …
MOST_PIECES = 40  # … in this many pieces of a step, at most
MOST_ROUND = 0.95  # of the body's depth: corners are no rounder than that

_WIDTH = len(COLUMNS)
_MASS, _GRAVITY, _TILT, _RADIUS, _STIFFNESS, _DAMPING = (
    COLUMNS.index(column)
    for column in (
        "mass",
        "gravity",
        "support_tilt.roll",
        "corner_radius.value",
        "contact_compliance.stiffness",
        "contact_compliance.damping",
    )
)


class ConvexSolid(NamedTuple):
    """A shape, the same in all lanes."""

    rims: bool  # whether its points are those of rims
    radius: float  # m, of its points: that of a ball
    depth: float  # m, to which corners may be rounded; of a round body 0
    isotropic: bool
    reach: float  # m, of its farthest point from the centre
    inertia: Numbers
    inverse: Numbers


class Room(NamedTuple):
    """Arrays as Lanes [...], and the same memory as numbers [..., LANES], by which a lane's own are moved."""

    machine: np.ndarray  # [P]: of unit mass
    coefficients: np.ndarray  # [K] of terms
    given: np.ndarray  # [GIVEN]
    corners: np.ndarray  # [N, 3]: the body's points, m
    points: np.ndarray  # [N, POINTS_WIDTH]
    touch: np.ndarray  # [N, TOUCH_WIDTH]
    shown: np.ndarray  # [SHOWN]


def rooms_of(points: int, coefficients: int) -> tuple[np.ndarray, ...]:
    """Numbers of a Room for bodies of so many points and terms of so many coefficients."""
    shapes = (
        (_WIDTH,),
        (coefficients,),
        (GIVEN,),
        (points, 3),
        (points, POINTS_WIDTH),
        (points, TOUCH_WIDTH),
        (SHOWN,),
    )
    sizes = [math.prod(shape) for shape in shapes]
    whole, ends = zeros(sum(sizes)), np.cumsum(sizes)
    return tuple(
        whole[end - size : end].reshape(*shape, LANES) for shape, size, end in zip(shapes, sizes, ends, strict=True)
    )


@compiled
def pieces(stiffness: float, mass: float, step: float) -> int:
    """Into how many pieces a step in touch is divided for a contact's spring."""
    if stiffness == math.inf:
        return 1
    phase = step * math.sqrt(4 * stiffness / mass)
    return min(max(math.ceil(phase / PHASE), 1), MOST_PIECES)


@compiled
def give(
    flat: Room, lane: int, machine: np.ndarray, first: np.ndarray, start: float, step: float, solid: ConvexSolid,
    of_shape: np.ndarray, inward: np.ndarray,
) -> None:  # fmt: skip
    """Put a machine [P + K] and a first state [13] of a shape's body into a lane."""
    for k in range(_WIDTH):
        flat.machine[k, lane] = machine[k]
    for k in (_STIFFNESS, _DAMPING):
        flat.machine[k, lane] = machine[k] / machine[_MASS]
    for k in range(len(flat.coefficients)):
        flat.coefficients[k, lane] = machine[_WIDTH + k]
    for k in range(STATE):
        flat.given[k, lane] = first[k]
    flat.given[START_TIME, lane], flat.given[TAKEN, lane] = start, 1.0
    rounding = min(machine[_RADIUS], MOST_ROUND * solid.depth)
    flat.given[ROUNDING, lane] = solid.radius + rounding
    flat.given[PIECES, lane] = pieces(machine[_STIFFNESS], machine[_MASS], step)
    pull = tilted_gravity(machine[_GRAVITY], machine[_TILT], machine[_TILT + 1])
    flat.given[GRAVITY, lane], flat.given[GRAVITY + 1, lane], flat.given[GRAVITY + 2, lane] = pull
    for k in range(len(of_shape)):
        for axis in range(3):
            flat.corners[k, axis, lane] = of_shape[k, axis] + rounding * inward[k, axis]
            flat.points[k, KEPT + axis, lane] = 0.0
        flat.points[k, ACTIVE, lane] = 0.0
        flat.touch[k, POINT, lane] = -1.0


@compiled
def list_touching(flat: Room, lane: int) -> None:
    """Make a lane's rows of `touch` those of its points that are marked; a point's impulse goes with it."""
    n = 0
    while n < len(flat.touch) and flat.touch[n, POINT, lane] >= 0:
        k = int(flat.touch[n, POINT, lane])
        for axis in range(3):
            flat.points[k, KEPT + axis, lane] = flat.touch[n, IMPULSE + axis, lane]
        flat.touch[n, POINT, lane] = -1.0
        n += 1
    n = 0
    for k in range(len(flat.points)):
        if flat.points[k, ACTIVE, lane] > 0:
            flat.touch[n, POINT, lane] = k
            for axis in range(3):
                flat.touch[n, CORNER + axis, lane] = flat.corners[k, axis, lane]
                flat.touch[n, IMPULSE + axis, lane] = flat.points[k, KEPT + axis, lane]
            n += 1


@compiled
def write(flat: Room, lane: int, rests: bool, out: np.ndarray) -> None:
    """A lane's sample into its states `out` [T, 13]; where the body rests, all that follow too."""
    sample = int(flat.shown[SAMPLE, lane])
    for row in range(sample, len(out) if rests else sample + 1):
        for k in range(STATE):
            out[row, k] = flat.shown[k, lane]
