"""Where the body may touch: its corners, or the points of its rims that are lowest now."""

import math
from typing import NamedTuple

import numpy as np

from vision_s2r.contact.lanes import Lanes, where
from vision_s2r.contact.shape import Shape
from vision_s2r.contact.vectors import Matrix, Quaternion, Vector, matrix
from vision_s2r.joint.compiled import compiled

Numbers = tuple[float, float, float, float, float, float, float, float, float]  # a matrix that is the same in all lanes


class Body(NamedTuple):
    """A shape a lane, each about its centre of mass; compiled code reads it.

    Points are balls of the radius `rounding` in a frame that turns with the body, or in that of its rims.
    """

    rims: bool
    rounding: Lanes
    center: Vector  # of the shape, from the centre of mass, in the body's frame
    inertia: Numbers  # by rows, of unit mass, in the body's frame
    inverse: Numbers
    isotropic: bool
    reach: Lanes  # of the farthest point from the centre of mass


def points_of(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Points [N, 3] of a shape, from its centre, and how each moves as all faces move inwards by 1.

    Of a ball its centre, of a cylinder four of either rim, in a frame whose x axis leads, across the cylinder's, to a
    rim's lowest point.
    """
    if shape.kind == "sphere":
        points = np.zeros((1, 3))
    elif shape.kind == "cylinder":
        quarters = ((1, 0), (0, 1), (-1, 0), (0, -1))
        radius, half = shape.radius, shape.half_length
        points = np.array([[radius * x, radius * y, end * half] for end in (1, -1) for x, y in quarters])
    else:
        return shape.points, shape.inward
    return points, np.zeros_like(points)


@compiled
def frame(body: Body, r: Matrix) -> Matrix:
    """The rotation of the points' frame, r being the body's."""
    if not body.rims:
        return r
    lean = math.sqrt(max(0.0, 1 - r[8] * r[8]))
    across = (r[8] * r[2] / lean, r[8] * r[5] / lean, (r[8] * r[8] - 1) / lean)
    x, y, z = where(lean > 1e-9, across, (r[0], r[3], r[6]))
    return (
        x, r[5] * z - r[8] * y, r[2],
        y, r[8] * x - r[2] * z, r[5],
        z, r[2] * y - r[5] * x, r[8],
    )  # fmt: skip


@compiled
def level(body: Body, position: Vector, r: Matrix, f: Matrix) -> tuple[Lanes, Vector]:
    """What heights of points are, as `along` has them: that of the centre less the rounding, and the way up."""
    center = position[2] + r[6] * body.center[0] + r[7] * body.center[1] + r[8] * body.center[2]
    return center - body.rounding, (f[6], f[7], f[8])


@compiled
def along(linear: tuple[Lanes, Vector], corners: np.ndarray, k: int) -> Lanes:
    """What changes linearly with the place of a point, at point k of corners [N, 3]."""
    base, slope = linear
    return base + slope[0] * corners[k, 0] + slope[1] * corners[k, 1] + slope[2] * corners[k, 2]


@compiled
def lowest_of(body: Body, corners: np.ndarray, position: Vector, q: Quaternion) -> Lanes:
    """Height of the lowest point over the support."""
    r = matrix(q)
    heights = level(body, position, r, frame(body, r))
    lowest = along(heights, corners, 0)
    for k in range(1, len(corners)):
        lowest = min(lowest, along(heights, corners, k))
    return lowest
