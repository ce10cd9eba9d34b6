"""Where the body may touch: its corners, or the points of its rims that are lowest now."""

import math
from typing import NamedTuple

import numpy as np

from vision_s2r.contact.vectors import Matrix, Quaternion, Vector
from vision_s2r.joint.compiled import compiled

CORNERS, BALL, ROLLER = 0, 1, 2
KINDS = {"box": CORNERS, "mesh": CORNERS, "sphere": BALL, "cylinder": ROLLER}


class Body(NamedTuple):
    """A shape about a centre of mass; compiled code reads it."""

    kind: int
    rounding: float  # radius of the ball at each corner
    center: Vector  # of the shape, from the centre of mass, in the body's frame
    radius: float
    half_length: float
    inertia: Matrix  # of unit mass
    inverse: Matrix
    isotropic: bool
    reach: float  # of the farthest point from the centre of mass


@compiled
def heights(body: Body, corners: np.ndarray, position: Vector, q: Quaternion, points: np.ndarray, column: int) -> float:
    """Heights of the body's points over the support, into a column of `points` [N, …]; the lowest of them.

    corners [N, 3] of a body that has them are seen from the centre of mass, in the body's frame.
    """
    down = (
        2 * (q[0] * q[2] - q[1] * q[3]),
        2 * (q[1] * q[2] + q[0] * q[3]),
        1 - 2 * (q[0] * q[0] + q[1] * q[1]),
    )
    lowest = math.inf
    if body.kind == CORNERS:
        for k in range(len(points)):
            gap = (
                position[2]
                + down[0] * corners[k, 0]
                + down[1] * corners[k, 1]
                + down[2] * corners[k, 2]
                - body.rounding
            )
            points[k, column] = gap
            lowest = min(lowest, gap)
        return lowest
    center = position[2] + down[0] * body.center[0] + down[1] * body.center[1] + down[2] * body.center[2]
    if body.kind == BALL:
        points[0, column] = center - body.radius
        return center - body.radius
    lean = math.sqrt(max(0.0, 1 - down[2] * down[2]))
    for k in range(8):
        rim = center + (body.half_length if k < 4 else -body.half_length) * down[2]
        turn = k % 4  # of the rim: at its lowest point, a quarter on, opposite, a quarter back
        gap = rim - body.radius * lean * (1.0 if turn == 0 else -1.0 if turn == 2 else 0.0)
        points[k, column] = gap
        lowest = min(lowest, gap)
    return lowest


@compiled
def arm(body: Body, corners: np.ndarray, r: Matrix, k: int) -> Vector:
    """From the centre of mass to point k, in the world's frame; r is the body's rotation."""
    if body.kind == CORNERS:
        x, y, z = corners[k, 0], corners[k, 1], corners[k, 2]
    else:
        x, y, z = body.center
    x, y, z = (
        r[0] * x + r[1] * y + r[2] * z,
        r[3] * x + r[4] * y + r[5] * z,
        r[6] * x + r[7] * y + r[8] * z,
    )
    if body.kind == CORNERS:
        return x, y, z - body.rounding
    if body.kind == BALL:
        return x, y, z - body.radius
    if body.kind == ROLLER:
        along = body.half_length if k < 4 else -body.half_length
        lean = math.sqrt(max(0.0, 1 - r[8] * r[8]))
        if lean > 1e-9:  # down, as far as the rim's plane lets it
            ox, oy, oz = r[8] * r[2] / lean, r[8] * r[5] / lean, (r[8] * r[8] - 1) / lean
        else:
            ox, oy, oz = r[0], r[3], r[6]
        turn = k % 4
        if turn == 1 or turn == 3:
            ox, oy, oz = r[5] * oz - r[8] * oy, r[8] * ox - r[2] * oz, r[2] * oy - r[5] * ox
        size = body.radius if turn < 2 else -body.radius
        x, y, z = x + along * r[2] + size * ox, y + along * r[5] + size * oy, z + along * r[8] + size * oz
    return x, y, z
