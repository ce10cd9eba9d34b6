"""What the support does to bodies: impulses at the points that touch, found together.

Projected Gauss–Seidel over Newton's law along the normal and Coulomb's cone across it (Moreau 1988; Jourdan, Alart and
Jean 1998), then friction against rolling and spinning. Everything is of unit mass.
"""

import math

import numpy as np

from vision_s2r.contact.effects.contact_compliance import spring_impulse
from vision_s2r.contact.effects.lateral_friction import in_cone, share_in_cone
from vision_s2r.contact.effects.rolling_friction import rolling_limit
from vision_s2r.contact.effects.spinning_friction import spinning_limit
from vision_s2r.contact.lanes import Lanes, Mask, any_of, everywhere, where
from vision_s2r.contact.machine import ContactMachine
from vision_s2r.contact.room import ACROSS, BEFORE, FRICTION, IMPULSE, LEVERS, POINT, PUSHED, TARGET, UPWARD, X, Y, Z
from vision_s2r.contact.vectors import Matrix, Vector, moved, times
from vision_s2r.joint.compiled import compiled

SWEEPS = 40  # at most
CLOSE = 5e-5  # m/s: sweeps end once none of them changes an impulse by more


@compiled
def add_point(touch: np.ndarray, n: int, at: Vector, tensor: Matrix, isotropic: bool) -> None:
    """How point n of those that touch resists; tensor is the inverse inertia of unit mass."""
    x, y, z = at
    touch[n, X], touch[n, Y], touch[n, Z] = x, y, z
    # upward, across: change of the point's velocity by a unit impulse there; across it depends on the direction, and
    # this is the most.
    if isotropic:
        each = tensor[0]
        east, north, up = (0.0, each * z, -each * y), (-each * z, 0.0, each * x), (each * y, -each * x, 0.0)
        upward = 1 + (up[0] * y - up[1] * x)
        across = upward + each * z * z
    else:
        east, north, up = times(tensor, (0.0, z, -y)), times(tensor, (-z, 0.0, x)), times(tensor, (y, -x, 0.0))
        upward = 1 + (up[0] * y - up[1] * x)
        xx = 1 + (east[1] * z - east[2] * y)
        yy = 1 - (north[0] * z - north[2] * x)
        across = _larger(xx, east[2] * x - east[0] * z, yy)
    touch[n, LEVERS], touch[n, LEVERS + 1], touch[n, LEVERS + 2] = east
    touch[n, LEVERS + 3], touch[n, LEVERS + 4], touch[n, LEVERS + 5] = north
    touch[n, LEVERS + 6], touch[n, LEVERS + 7], touch[n, LEVERS + 8] = up
    touch[n, PUSHED], touch[n, PUSHED + 1] = up[1] * z - up[2] * y, up[2] * x - up[0] * z
    inverse = 1 / (upward * across)  # one division for both
    touch[n, UPWARD], touch[n, ACROSS] = inverse * across, inverse * upward


@compiled
def _larger(xx: Lanes, xy: Lanes, yy: Lanes) -> Lanes:
    """Eigenvalue of a symmetric matrix."""
    apart = xx - yy
    return 0.5 * (xx + yy) + math.sqrt(0.25 * apart * apart + xy * xy)


@compiled
def solve(
    machine: ContactMachine, tensor: Matrix, touch: np.ndarray, count: int, solving: Mask, velocity: Vector,
    spin: Vector, spring: Mask, step: Lanes,
) -> tuple[Vector, Vector]:  # fmt: skip
    """Velocity and spin after the impulses of points in the first `count` rows of touch, which suggests and holds them.

    Nothing changes in lanes that are not `solving`, nor by rows without a point. A lane's sweeps end for it alone.
    """
    springs = any_of(solving & spring)
    rolls = any_of(solving & ((machine.rolling_friction_value > 0) | (machine.spinning_friction_value > 0)))
    rolled = (everywhere(0.0), everywhere(0.0), everywhere(0.0))
    for n in range(count):
        held = (touch[n, IMPULSE], touch[n, IMPULSE + 1], touch[n, IMPULSE + 2])
        x, y, z = where(solving & (touch[n, POINT] >= 0), held, (0.0, 0.0, 0.0))
        velocity = (velocity[0] + x, velocity[1] + y, velocity[2] + z)
        spin = _spun(_spun(_spun(spin, x, touch, n, 0), y, touch, n, 1), z, touch, n, 2)
    for _ in range(SWEEPS):
        change = total = everywhere(0.0)
        for n in range(count):
            here = solving & (touch[n, POINT] >= 0)
            if not any_of(here):
                break
            velocity, spin, changed, normal = _pressed(machine, touch, n, here, velocity, spin, springs, spring, step)
            change, total = max(change, changed), total + normal
        if rolls:
            spin, rolled = _braked(machine, tensor, solving, spin, rolled, total)
        solving = solving & ~(change < CLOSE)
        if not any_of(solving):
            break
    return velocity, spin


@compiled
def _spun(spin: Vector, impulse: Lanes, touch: np.ndarray, n: int, axis: int) -> Vector:
    """The spin after an impulse along an axis at a point."""
    at = LEVERS + 3 * axis
    return moved(spin, impulse, (touch[n, at], touch[n, at + 1], touch[n, at + 2]))


@compiled
def _pressed(
    machine: ContactMachine, touch: np.ndarray, n: int, here: Mask, velocity: Vector, spin: Vector, springs: bool,
    spring: Mask, step: Lanes,
) -> tuple[Vector, Vector, Lanes, Lanes]:  # fmt: skip
    """Point n's impulse anew: velocity and spin, the largest change of the impulse, its normal part.

    All waits for this, and so what can be is reckoned beside the chain: velocities across as they are before the
    normal impulse, and what that changes; the motion without friction, and what all of the wished friction would do.
    """
    x, y, z = touch[n, X], touch[n, Y], touch[n, Z]
    held_x, held_y, held = touch[n, IMPULSE], touch[n, IMPULSE + 1], touch[n, IMPULSE + 2]
    speed = velocity[2] + spin[0] * y - spin[1] * x
    east, north = velocity[0] + spin[1] * z - spin[2] * y, velocity[1] + spin[2] * x - spin[0] * z
    normal = max(0.0, held + touch[n, TARGET] * touch[n, UPWARD] - speed * touch[n, UPWARD])
    if springs:
        stiffness, damping = machine.contact_compliance_stiffness, machine.contact_compliance_damping  # of unit mass
        before, mobility = touch[n, BEFORE], 1 / touch[n, UPWARD]
        firm = where(before < 0, damping * (1 + machine.restitution), damping)
        pushed = spring_impulse(held, touch[n, TARGET], (before, speed), mobility, (stiffness, firm), step)
        normal = where(spring, pushed, normal)
    normal = where(here, normal, held)
    more = normal - held
    east, north = east + more * touch[n, PUSHED], north + more * touch[n, PUSHED + 1]
    soft = touch[n, ACROSS]
    wish_x, wish_y = held_x - east * soft, held_y - north * soft
    share = share_in_cone(wish_x, wish_y, touch[n, FRICTION] * normal)
    still = (everywhere(0.0), everywhere(0.0), everywhere(0.0))
    wished = _spun(_spun(still, wish_x, touch, n, 0), wish_y, touch, n, 1)
    without = _spun(_spun(_spun(spin, more, touch, n, 2), -held_x, touch, n, 0), -held_y, touch, n, 1)
    new_x, new_y = where(here, (share * wish_x, share * wish_y), (held_x, held_y))
    moving = (velocity[0] - held_x + share * wish_x, velocity[1] - held_y + share * wish_y, velocity[2] + more)
    velocity, spin = where(here, (moving, moved(without, share, wished)), (velocity, spin))
    touch[n, IMPULSE], touch[n, IMPULSE + 1], touch[n, IMPULSE + 2] = new_x, new_y, normal
    change = max(abs(more), max(abs(new_x - held_x), abs(new_y - held_y)))
    return velocity, spin, change, where(here, normal, 0.0)


@compiled
def _braked(
    machine: ContactMachine, tensor: Matrix, solving: Mask, spin: Vector, rolled: Vector, total: Lanes
) -> tuple[Vector, Vector]:
    """Spin and angular impulse against rolling and spinning, under a normal impulse of all points."""
    soft = _larger(tensor[0], tensor[1], tensor[4])
    most = rolling_limit(machine.rolling_friction_value, total)
    x, y = in_cone(rolled[0] - spin[0] / soft, rolled[1] - spin[1] / soft, most)
    most = spinning_limit(machine.spinning_friction_value, total)
    z = min(max(rolled[2] - spin[2] / tensor[8], -most), most)
    new = where(solving, (x, y, z), rolled)
    return moved(spin, 1.0, times(tensor, moved(new, -1.0, rolled))), new
