"""Vectors, rotations and matrices as tuples of lanes: compiled code keeps them in registers."""

import math

from vision_s2r.contact.lanes import Lanes, any_of, where
from vision_s2r.joint.compiled import compiled

Vector = tuple[Lanes, Lanes, Lanes]
Quaternion = tuple[Lanes, Lanes, Lanes, Lanes]  # x, y, z, w; unit
Matrix = tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]  # by rows

SMALL = 0.5  # rad: rotations up to it by series, to 1e-12


@compiled
def moved(a: Vector, factor: Lanes, b: Vector) -> Vector:
    """a + factor·b."""
    return a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def times(m: Matrix, a: Vector) -> Vector:
    """m·a."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@compiled
def turned(q: Quaternion, spin: Vector, time: Lanes) -> Quaternion:
    """The attitude after `time` at a constant spin (rad/s, in the world's frame)."""
    half_time = 0.5 * time
    x, y, z = half_time * spin[0], half_time * spin[1], half_time * spin[2]
    square = x * x + y * y + z * z  # of half the angle
    sine = 1 + square * (-1 / 6 + square * (1 / 120 + square * (-1 / 5040 + square * (1 / 362880))))
    w = -1 / 720 + square * (1 / 40320 + square * (-1 / 3628800))
    w = 1 + square * (-1 / 2 + square * (1 / 24 + square * w))
    large = square >= 0.25 * SMALL * SMALL
    if any_of(large):
        half = math.sqrt(square)
        sine, w = where(large, (math.sin(half) / half, math.cos(half)), (sine, w))
    x, y, z = sine * x, sine * y, sine * z
    new = (
        w * q[0] + x * q[3] + y * q[2] - z * q[1],
        w * q[1] - x * q[2] + y * q[3] + z * q[0],
        w * q[2] + x * q[1] - y * q[0] + z * q[3],
        w * q[3] - x * q[0] - y * q[1] - z * q[2],
    )
    # One step of Newton's towards a norm of 1, from which rounding alone leads away.
    scale = 1.5 - 0.5 * (new[0] * new[0] + new[1] * new[1] + new[2] * new[2] + new[3] * new[3])
    return scale * new[0], scale * new[1], scale * new[2], scale * new[3]


@compiled
def matrix(q: Quaternion) -> Matrix:
    """The rotation from the body's frame to the world's."""
    x, y, z, w = q
    return (
        1 - 2 * (y * y + z * z),
        2 * (x * y - z * w),
        2 * (x * z + y * w),
        2 * (x * y + z * w),
        1 - 2 * (x * x + z * z),
        2 * (y * z - x * w),
        2 * (x * z - y * w),
        2 * (y * z + x * w),
        1 - 2 * (x * x + y * y),
    )


@compiled
def carried(r: Matrix, m: Matrix) -> Matrix:
    """r·m·r⊤ of a symmetric m: a tensor of the body in the world's frame."""
    a = times(m, (r[0], r[1], r[2]))
    b = times(m, (r[3], r[4], r[5]))
    c = times(m, (r[6], r[7], r[8]))
    xy = r[3] * a[0] + r[4] * a[1] + r[5] * a[2]
    xz = r[6] * a[0] + r[7] * a[1] + r[8] * a[2]
    yz = r[6] * b[0] + r[7] * b[1] + r[8] * b[2]
    return (
        r[0] * a[0] + r[1] * a[1] + r[2] * a[2],
        xy,
        xz,
        xy,
        r[3] * b[0] + r[4] * b[1] + r[5] * b[2],
        yz,
        xz,
        yz,
        r[6] * c[0] + r[7] * c[1] + r[8] * c[2],
    )
