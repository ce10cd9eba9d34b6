"""What the support does to the body: impulses at the points that touch, found together.

Projected Gauss–Seidel over Newton's law along the normal and Coulomb's cone across it (Moreau 1988; Jourdan, Alart and
Jean 1998), then friction against rolling and spinning. Everything is of unit mass.
"""

import math

import numpy as np

from vision_s2r.contact.effects.contact_compliance import spring_impulse
from vision_s2r.contact.effects.lateral_friction import in_cone
from vision_s2r.contact.effects.rolling_friction import rolling_limit
from vision_s2r.contact.effects.spinning_friction import spinning_limit
from vision_s2r.contact.machine import ContactMachine
from vision_s2r.contact.vectors import Matrix, Vector, moved, times
from vision_s2r.joint.compiled import compiled

SWEEPS = 40  # at most
CLOSE = 5e-5  # m/s: sweeps end once none of them changes an impulse by more


# Columns of `touch` [N, TOUCH_WIDTH], a row a point that touches. (Plain arrays, not fields of a tuple: numba counts
# references to those at every use.)
POINT, X, Y, Z = 0, 1, 2, 3  # which of the body's points, and its place from the centre of mass
LEVERS = 4  # change of spin by a unit impulse along x, y and z: nine numbers
UPWARD, ACROSS = 13, 14  # impulse for a unit change of the point's velocity: along the normal, and at least across it
TARGET = 15  # normal velocity that a rigid point keeps at least; depth of a spring's
BEFORE = 16  # normal velocity before
FRICTION = 17  # coefficient
TOUCH_WIDTH = 18
# Columns of `points` [N, POINTS_WIDTH], a row a point of the body.
IMPULSE = 0  # x, y and z: of the last solution, where the next begins
START, MIDDLE, END = 3, 4, 5  # heights
ACTIVE = 6  # 1 where it touches
POINTS_WIDTH = 7


@compiled
def add_point(touch: np.ndarray, n: int, k: int, at: Vector, tensor: Matrix) -> None:
    """Point k of the body as number n of those that touch; tensor is the inverse inertia of unit mass."""
    x, y, z = at
    touch[n, POINT], touch[n, X], touch[n, Y], touch[n, Z] = k, x, y, z
    east, north, up = times(tensor, (0.0, z, -y)), times(tensor, (-z, 0.0, x)), times(tensor, (y, -x, 0.0))
    touch[n, LEVERS], touch[n, LEVERS + 1], touch[n, LEVERS + 2] = east
    touch[n, LEVERS + 3], touch[n, LEVERS + 4], touch[n, LEVERS + 5] = north
    touch[n, LEVERS + 6], touch[n, LEVERS + 7], touch[n, LEVERS + 8] = up
    touch[n, UPWARD] = 1 / (1 + up[0] * y - up[1] * x)
    xx = 1 + east[1] * z - east[2] * y
    yy = 1 - north[0] * z + north[2] * x
    xy = -east[0] * z + east[2] * x
    touch[n, ACROSS] = 1 / (0.5 * (xx + yy) + math.sqrt(0.25 * (xx - yy) ** 2 + xy * xy))


@compiled
def _spun(spin: Vector, impulse: float, touch: np.ndarray, n: int, axis: int) -> Vector:
    """The spin after an impulse along an axis at a point."""
    at = LEVERS + 3 * axis
    return moved(spin, impulse, (touch[n, at], touch[n, at + 1], touch[n, at + 2]))


@compiled
def solve(
    machine: ContactMachine, tensor: Matrix, points: np.ndarray, touch: np.ndarray, count: int, velocity: Vector,
    spin: Vector, spring: bool, step: float,
) -> tuple[Vector, Vector]:  # fmt: skip
    """Velocity and spin after the impulses of `count` points, which `points` suggests and then holds."""
    stiffness = machine.contact_compliance_stiffness / machine.mass
    damping = machine.contact_compliance_damping / machine.mass
    rolls = machine.rolling_friction_value > 0 or machine.spinning_friction_value > 0
    roll_x, roll_y, roll_z = 0.0, 0.0, 0.0
    for n in range(count):
        k = int(touch[n, POINT])
        x, y, z = points[k, IMPULSE], points[k, IMPULSE + 1], points[k, IMPULSE + 2]
        velocity = (velocity[0] + x, velocity[1] + y, velocity[2] + z)
        spin = _spun(_spun(_spun(spin, x, touch, n, 0), y, touch, n, 1), z, touch, n, 2)
    for _ in range(SWEEPS):
        change, total = 0.0, 0.0
        for n in range(count):
            k = int(touch[n, POINT])
            x, y, z = touch[n, X], touch[n, Y], touch[n, Z]
            held_x, held_y, held = points[k, IMPULSE], points[k, IMPULSE + 1], points[k, IMPULSE + 2]
            speed = velocity[2] + spin[0] * y - spin[1] * x
            if spring:
                before = touch[n, BEFORE]
                firm = damping * (1 + machine.restitution) if before < 0 else damping
                normal = spring_impulse(
                    held, touch[n, TARGET], (before, speed), 1 / touch[n, UPWARD], (stiffness, firm), step
                )
            else:
                normal = max(0.0, held + (touch[n, TARGET] - speed) * touch[n, UPWARD])
            more = normal - held
            velocity = (velocity[0], velocity[1], velocity[2] + more)
            spin = _spun(spin, more, touch, n, 2)
            east = velocity[0] + spin[1] * z - spin[2] * y
            north = velocity[1] + spin[2] * x - spin[0] * z
            soft = touch[n, ACROSS]
            new_x, new_y = in_cone(held_x - east * soft, held_y - north * soft, touch[n, FRICTION] * normal)
            more_x, more_y = new_x - held_x, new_y - held_y
            velocity = (velocity[0] + more_x, velocity[1] + more_y, velocity[2])
            spin = _spun(_spun(spin, more_x, touch, n, 0), more_y, touch, n, 1)
            points[k, IMPULSE], points[k, IMPULSE + 1], points[k, IMPULSE + 2] = new_x, new_y, normal
            change = max(change, abs(more), abs(more_x), abs(more_y))
            total += normal
        if rolls:
            soft = 0.5 * (tensor[0] + tensor[4]) + math.sqrt(0.25 * (tensor[0] - tensor[4]) ** 2 + tensor[1] ** 2)
            most = rolling_limit(machine.rolling_friction_value, total)
            new_x, new_y = in_cone(roll_x - spin[0] / soft, roll_y - spin[1] / soft, most)
            most = spinning_limit(machine.spinning_friction_value, total)
            new_z = min(max(roll_z - spin[2] / tensor[8], -most), most)
            turn = (new_x - roll_x, new_y - roll_y, new_z - roll_z)
            spin = moved(spin, 1.0, times(tensor, turn))
            roll_x, roll_y, roll_z = new_x, new_y, new_z
        if change < CLOSE:
            break
    return velocity, spin
