"""Which points touch in the middle of a step, what they ask for there, and which of the others hits first."""

import numpy as np

from vision_s2r.contact.effects.restitution import SLOW, rebound
from vision_s2r.contact.impulses import add_point
from vision_s2r.contact.lanes import Lanes, Mask, any_of, everywhere, where
from vision_s2r.contact.machine import ContactMachine
from vision_s2r.contact.points import Body, along, frame, level
from vision_s2r.contact.room import (
    ACTIVE,
    BEFORE,
    CORNER,
    END,
    FRICTION,
    IMPULSE,
    KEPT,
    POINT,
    START,
    TARGET,
    Room,
)
from vision_s2r.contact.terms import friction_of
from vision_s2r.contact.vectors import Matrix, Vector, times
from vision_s2r.joint.compiled import compiled


@compiled
def mark(
    body: Body, room: Room, r: Matrix, position: Vector, velocity: Vector, spin: Vector, near: Lanes, anyway: Mask,
    looking: Mask,
) -> tuple[Mask, Mask]:  # fmt: skip
    """Marks the points that touch; the lanes in which one does, and those in which others did before.

    A point that is nearer than `near` touches where it approaches no faster than a contact does, or `anyway`. Nothing
    touches in lanes that are not `looking`.
    """
    f, c = frame(body, r), body.center
    heights = level(body, position, r, f)
    east, north = r[0] * c[0] + r[1] * c[1] + r[2] * c[2], r[3] * c[0] + r[4] * c[1] + r[5] * c[2]
    speeds = (
        velocity[2] + spin[0] * north - spin[1] * east,
        (spin[0] * f[3] - spin[1] * f[0], spin[0] * f[4] - spin[1] * f[1], spin[0] * f[5] - spin[1] * f[2]),
    )
    touches = others = everywhere(False)
    for k in range(len(room.points)):
        active = looking & (along(heights, room.corners, k) < near)
        active = active & (anyway | (along(speeds, room.corners, k) >= -SLOW))
        touches = touches | active
        others = others | (active ^ (room.points[k, ACTIVE] > 0))
        room.points[k, ACTIVE] = where(active, 1.0, 0.0)
    return touches, others & looking


@compiled
def forget(room: Room, impact: Mask) -> None:
    """What a step's impulses were says nothing of an impact's, nor the other way round."""
    for k in range(len(room.points)):
        for axis in range(3):
            room.points[k, KEPT + axis] = where(impact, 0.0, room.points[k, KEPT + axis])
            room.touch[k, IMPULSE + axis] = where(impact, 0.0, room.touch[k, IMPULSE + axis])


@compiled
def resist(
    machine: ContactMachine, body: Body, room: Room, terms: np.ndarray, r: Matrix, tensor: Matrix,
    moving: tuple[Vector, Vector, Vector], impact: Mask, spring: Mask, time: Lanes, step: Lanes, looking: Mask,
) -> int:  # fmt: skip
    """What the points that touch ask for, and how they resist it; the rows of `touch` that have any.

    `moving`: position, velocity and spin of the body.
    """
    touch, (position, velocity, spin) = room.touch, moving
    center, f = times(r, body.center), frame(body, r)
    for n in range(len(touch)):
        if not any_of(looking & (touch[n, POINT] >= 0)):
            return n
        corner = times(f, (touch[n, CORNER], touch[n, CORNER + 1], touch[n, CORNER + 2]))
        x, y, z = center[0] + corner[0], center[1] + corner[1], center[2] + corner[2] - body.rounding
        add_point(touch, n, (x, y, z), tensor, body.isotropic)
        gap = position[2] + z
        approach = velocity[2] + spin[0] * y - spin[1] * x
        kept = where(spring, -gap, min(-gap / step, SLOW))
        touch[n, TARGET] = where(impact, rebound(approach, machine.restitution), kept)
        touch[n, BEFORE] = approach
        east = velocity[0] + spin[1] * z - spin[2] * y
        north = velocity[1] + spin[2] * x - spin[0] * z
        touch[n, FRICTION] = friction_of(
            terms, room.coefficients, machine.lateral_friction, position, east, north, time
        )
    return len(touch)


@compiled
def first_hit(room: Room, tolerance: Lanes, spring: Mask) -> Lanes:
    """The share of the try after which the first point that was not in touch is at the support; 2 if none is.

    A spring's point is in touch when it is below the support; a rigid one that hits is at it before it does.
    """
    share = everywhere(2.0)
    for k in range(len(room.points)):
        gap, end = room.points[k, START], room.points[k, END]
        off = gap > tolerance
        hits = (end < -tolerance) & ((spring & off) | (~spring & (room.points[k, ACTIVE] == 0)))
        if any_of(hits):
            share = where(hits, min(share, where(off, gap / (gap - end), 0.0)), share)
    return share


@compiled
def measure(body: Body, room: Room, position: Vector, r: Matrix, column: int) -> Lanes:
    """Heights of the points into a column of `points`; the lowest of them."""
    heights = level(body, position, r, frame(body, r))
    lowest = along(heights, room.corners, 0)
    room.points[0, column] = lowest
    for k in range(1, len(room.points)):
        room.points[k, column] = along(heights, room.corners, k)
        lowest = min(lowest, room.points[k, column])
    return lowest
