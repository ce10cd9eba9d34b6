"""Bodies in flight and on their support, sample by sample, a lane each.

Moreau's midpoint scheme: half a step of free motion, the forces and impulses there, the other half; of second order.
A step in which another point would reach the support is cut there, the impact is taken, and the rest follows: when and
where a body hits depends smoothly on everything.

Lanes step together, each at a time of its own: one may fly a whole sample while another takes an impact.
"""

import math
from typing import NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vision_s2r.contact.effects.restitution import SLOW
from vision_s2r.contact.impulses import solve
from vision_s2r.contact.lanes import LANES, Lanes, Mask, any_of, bits, everywhere, in_lanes, where
from vision_s2r.contact.machine import COLUMNS, ContactMachine
from vision_s2r.contact.points import Body, lowest_of
from vision_s2r.contact.room import (
    END,
    GRAVITY,
    PIECES,
    ROUNDING,
    SAMPLE,
    START,
    START_TIME,
    TAKEN,
    ConvexSolid,
    Room,
    give,
    list_touching,
    write,
)
from vision_s2r.contact.terms import acceleration, varying
from vision_s2r.contact.touching import first_hit, forget, mark, measure, resist
from vision_s2r.contact.vectors import Matrix, Quaternion, Vector, carried, cross, matrix, moved, times, turned
from vision_s2r.joint.compiled import compiled

TOUCH = 1e-5  # of the body's reach: points as near as that are at the support
EVENTS = 20  # impacts within one sample, at most
STILL = 1e-5  # m/s: a body that is as slow at two samples stays where it is
DONE = 1e-9  # of the sample time: less than that is left of it

_WIDTH = len(COLUMNS)

State = tuple[Vector, Quaternion, Vector, Vector]  # of the centre of mass: position, attitude, velocity, spin


class Lot(NamedTuple):
    """What lanes have been given."""

    machine: ContactMachine
    body: Body
    gravity: Vector
    start: Lanes  # s since the episode began
    in_touch: Lanes  # s, of a step near the support, at most
    spring: Mask  # where a contact gives way
    tolerance: Lanes  # m: points as near as that are at the support


class Course(NamedTuple):
    """How far lanes have come."""

    alive: Mask  # where there is a body that is not done
    state: State
    lowest: Lanes  # m, height of the lowest point
    sample: Lanes  # the last that is written
    left: Lanes  # s, until the next
    cut: Lanes  # s: the next try is no longer, since something hits in it
    impact: Mask  # where the next try is an impact of all points at the support: a step of 0
    events: Lanes  # impacts since the sample
    still: Mask  # where the body did not move at the sample


class Clock(NamedTuple):
    """The same in all lanes."""

    sample_time: float  # s
    longest: float  # s, of a step in which forces change
    last: int  # sample


@compiled
def run(
    machines: np.ndarray, solid: ConvexSolid, of_shape: np.ndarray, inward: np.ndarray, first: np.ndarray,
    starts: np.ndarray, order: np.ndarray, clock: Clock, terms: np.ndarray, share: int, shares: int, flat: Room,
    out: np.ndarray,
) -> None:  # fmt: skip
    """Motions of machines [C, P] from first states [W, 13] into out [C, W, T, 13], from the second sample on.

    Of every `shares` lots of bodies one. Those of a lot begin together, and are the same motion under one machine after
    the other, then the next in `order` [W]: alike, they fly and hit at the same times, and hardly wait for each other.
    """
    room = Room(
        in_lanes(flat.machine), in_lanes(flat.coefficients), in_lanes(flat.given), in_lanes(flat.corners),
        in_lanes(flat.points), in_lanes(flat.touch), in_lanes(flat.shown),
    )  # fmt: skip
    end = len(machines) * len(first)
    for begin in range(share * LANES, end, shares * LANES):
        for lane in range(LANES):
            flat.given[TAKEN, lane] = 0.0
            if begin + lane < end:
                c, w = _which(begin + lane, len(machines), order)
                give(flat, lane, machines[c], first[w], starts[w], clock.longest, solid, of_shape, inward)
        lot = _lot(solid, room, clock)
        progress = _begun(lot, room, clock)
        while any_of(progress.alive):
            progress, done = _tried(lot, room, flat, terms, progress, clock)
            if any_of(done):
                progress, rests = _arrived(lot, room, progress, done, varying(terms), clock)
                for lane in range(LANES):
                    if bits(done) >> lane & 1:
                        c, w = _which(begin + lane, len(machines), order)
                        write(flat, lane, bits(rests) >> lane & 1 == 1, out[c, w])


@compiled
def _which(body: int, machines: int, order: np.ndarray) -> tuple[int, int]:
    """The machine and the window of the n-th body."""
    place, machine = divmod(body, machines)
    return machine, order[place]


@compiled
def _lot(solid: ConvexSolid, room: Room, clock: Clock) -> Lot:
    given = room.given
    machine = ContactMachine(*to_fixed_tuple(room.machine, _WIDTH))  # type: ignore[call-arg]
    x, y, z = machine.center_of_mass_x, machine.center_of_mass_y, machine.center_of_mass_z
    reach = solid.reach + math.sqrt(x * x + y * y + z * z)
    body = Body(solid.rims, given[ROUNDING], (-x, -y, -z), solid.inertia, solid.inverse, solid.isotropic, reach)
    gravity = (given[GRAVITY], given[GRAVITY + 1], given[GRAVITY + 2])
    spring = machine.contact_compliance_stiffness < math.inf
    in_touch = clock.longest / given[PIECES]
    return Lot(machine, body, gravity, given[START_TIME], in_touch, spring, TOUCH * reach)


@compiled
def _begun(lot: Lot, room: Room, clock: Clock) -> Course:
    """Bodies at their first states."""
    state, nowhere, zero = _read(lot.body, room.given), everywhere(False), everywhere(0.0)
    lowest = measure(lot.body, room, state[0], matrix(state[1]), START)
    left, uncut = everywhere(clock.sample_time), everywhere(math.inf)
    return Course(room.given[TAKEN] > 0, state, lowest, zero, left, uncut, nowhere, zero, nowhere)


@compiled
def _tried(lot: Lot, room: Room, flat: Room, terms: np.ndarray, p: Course, clock: Clock) -> tuple[Course, Mask]:
    """A try of a step, which counts unless something hits in it; and where that brings the next sample."""
    far, step = _step(lot, p, lot.body.isotropic and len(room.coefficients) == 0, clock)
    near = p.alive & ~far
    settling = p.events >= EVENTS  # it rattles: what still approaches is at rest
    middle = _drifted(p.state, 0.5 * step)
    time = lot.start + (p.sample + 1) * clock.sample_time - p.left + 0.5 * step
    r = matrix(middle[1])
    tensor = lot.body.inverse if lot.body.isotropic else carried(r, lot.body.inverse)
    velocity, spin = _free(lot, room, terms, middle, r, tensor, time, step)
    if any_of(near):
        velocity, spin = _supported(
            lot, room, flat, terms, middle, r, tensor, velocity, spin, time, step, p.impact, settling, near
        )
    after = _drifted((middle[0], middle[1], velocity, spin), 0.5 * step)
    lowest = measure(lot.body, room, after[0], matrix(after[1]), END)

    share = everywhere(2.0)
    sunk = near & ~(p.impact | settling) & (lowest < -lot.tolerance)
    if any_of(sunk):
        share = where(sunk, first_hit(room, lot.tolerance, lot.spring), share)
    again, taken = p.alive & (share > 0) & (share < 2), p.alive & (share == 2)
    for k in range(len(room.points)):
        room.points[k, START] = where(taken, room.points[k, END], room.points[k, START])
    state, lowest, left = where(taken, (after, lowest, p.left - step), (p.state, p.lowest, p.left))
    reached = taken & (p.cut < math.inf) & (lowest <= lot.tolerance) & ~lot.spring
    impact = p.alive & ((share == 0) | reached)
    cut, events = where(again, share * step, math.inf), where(impact, p.events + 1, p.events)
    done = taken & ~impact & (left <= DONE * clock.sample_time)
    return Course(p.alive, state, lowest, p.sample, left, cut, impact, events, p.still), done


@compiled
def _step(lot: Lot, p: Course, ballistic: bool, clock: Clock) -> tuple[Mask, Lanes]:
    """Where a body stays clear of the support until the next sample, and how long a step to try."""
    _, _, velocity, spin = p.state
    speed = abs(velocity[2]) + lot.machine.gravity * p.left + lot.body.reach * (abs(spin[0]) + abs(spin[1]))
    far = p.alive & ~p.impact & (p.lowest > speed * p.left)
    flight = p.left if ballistic else min(p.left, clock.longest)
    return far, where(p.impact, 0.0, where(far, flight, min(min(p.left, p.cut), lot.in_touch)))


@compiled
def _drifted(state: State, time: Lanes) -> State:
    """After a time at these velocities."""
    position, q, velocity, spin = state
    return moved(position, time, velocity), turned(q, spin, time), velocity, spin


@compiled
def _free(
    lot: Lot, room: Room, terms: np.ndarray, middle: State, r: Matrix, tensor: Matrix, time: Lanes, step: Lanes
) -> tuple[Vector, Vector]:
    """Velocity and spin after the forces of a step but the support's; tensor is the inverse inertia."""
    position, q, velocity, spin = middle
    faster = moved(velocity, step, lot.gravity)
    if len(room.coefficients) > 0:
        lowest = lowest_of(lot.body, room.corners, position, q)
        faster = moved(faster, step, acceleration(terms, room.coefficients, position, velocity, lowest, time))
    if lot.body.isotropic:
        return faster, spin
    inertia = carried(r, lot.body.inertia)
    half = moved(spin, -0.5 * step, times(tensor, cross(spin, times(inertia, spin))))
    return faster, moved(spin, -step, times(tensor, cross(half, times(inertia, half))))


@compiled
def _supported(
    lot: Lot, room: Room, flat: Room, terms: np.ndarray, middle: State, r: Matrix, tensor: Matrix, faster: Vector,
    turning: Vector, time: Lanes, step: Lanes, impact: Mask, settling: Mask, near: Mask,
) -> tuple[Vector, Vector]:  # fmt: skip
    """Velocity and spin after the support's impulses too, where bodies are near it."""
    position, _, velocity, spin = middle
    within = where(impact, lot.tolerance, where(lot.spring, 0.0, SLOW * step))
    anyway = impact | settling | lot.spring
    touches, others = mark(lot.body, room, r, position, velocity, spin, within, anyway, near)
    if any_of(others):
        for lane in range(LANES):
            if bits(others) >> lane & 1:
                list_touching(flat, lane)
    if any_of(impact):
        forget(room, impact)
    if any_of(touches):
        moving = (position, velocity, spin)
        count = resist(lot.machine, lot.body, room, terms, r, tensor, moving, impact, lot.spring, time, step, near)
        faster, turning = solve(lot.machine, tensor, room.touch, count, touches, faster, turning, lot.spring, step)
    if any_of(impact):
        forget(room, impact)
    return faster, turning


@compiled
def _arrived(lot: Lot, room: Room, p: Course, done: Mask, varying: bool, clock: Clock) -> tuple[Course, Mask]:
    """Shows the sample that lanes have come to; and where the body rests from now on, unless forces are `varying`."""
    sample = where(done, p.sample + 1, p.sample)
    _show(lot.body, p.state, room.shown)
    room.shown[SAMPLE] = sample
    slow = everywhere(not varying) & _slow(lot.body, p.state)
    rests = done & slow & p.still
    return (
        Course(
            p.alive & ~rests & ~(done & (sample >= clock.last)),
            p.state,
            p.lowest,
            sample,
            where(done, clock.sample_time, p.left),
            p.cut,
            p.impact,
            where(done, 0.0, p.events),
            (p.still & ~done) | (slow & done),
        ),
        rests,
    )


@compiled
def _slow(body: Body, state: State) -> Mask:
    """Whether a body moves by no more than what rounding and unfinished sweeps leave."""
    _, _, velocity, spin = state
    fast = max(abs(velocity[0]), max(abs(velocity[1]), abs(velocity[2])))
    return (fast < STILL) & (body.reach * max(abs(spin[0]), max(abs(spin[1]), abs(spin[2]))) < STILL)


@compiled
def _read(body: Body, row: np.ndarray) -> State:
    """The state of the centre of mass."""
    q, spin = (row[3], row[4], row[5], row[6]), (row[10], row[11], row[12])
    offset = times(matrix(q), body.center)
    place, speed = (row[0], row[1], row[2]), (row[7], row[8], row[9])
    return moved(place, -1.0, offset), q, moved(speed, -1.0, cross(spin, offset)), spin


@compiled
def _show(body: Body, state: State, row: np.ndarray) -> None:
    """Pose and velocities of the centre of the shape."""
    position, q, velocity, spin = state
    offset = times(matrix(q), body.center)
    row[0], row[1], row[2] = moved(position, 1.0, offset)
    row[3], row[4], row[5], row[6] = q
    row[7], row[8], row[9] = moved(velocity, 1.0, cross(spin, offset))
    row[10], row[11], row[12] = spin
