"""A body in flight and on its support, sample by sample.

Moreau's midpoint scheme: half a step of free motion, the forces and impulses there, the other half; of second order.
A step in which another point would reach the support is cut there, the impact is taken, and the rest follows: when and
where a body hits depends smoothly on everything.
"""

import math

import numpy as np

from vision_s2r.contact.effects.restitution import SLOW, rebound
from vision_s2r.contact.effects.support_tilt import tilted_gravity
from vision_s2r.contact.impulses import (
    ACTIVE,
    BEFORE,
    END,
    FRICTION,
    IMPULSE,
    MIDDLE,
    START,
    TARGET,
    add_point,
    solve,
)
from vision_s2r.contact.machine import ContactMachine
from vision_s2r.contact.points import Body, arm, heights
from vision_s2r.contact.terms import acceleration, directed
from vision_s2r.contact.vectors import Matrix, Quaternion, Vector, carried, cross, matrix, moved, times, turned
from vision_s2r.joint.compiled import compiled

TOUCH = 1e-5  # of the body's reach: points as near as that are at the support
EVENTS = 20  # impacts within one sample, at most
PHASE = 0.3  # of a contact spring's oscillation, in rad, that a step goes through at most …
STILL = 1e-5  # m/s: a body that is as slow at two samples stays where it is
MOST_PIECES = 40  # … in this many pieces of a step, at most

State = tuple[Vector, Quaternion, Vector, Vector]  # of the centre of mass: position, attitude, velocity, spin


@compiled
def pieces(machine: ContactMachine, step: float) -> int:
    """Into how many pieces a step in touch is divided for a contact's spring."""
    if machine.contact_compliance_stiffness == math.inf:
        return 1
    phase = step * math.sqrt(4 * machine.contact_compliance_stiffness / machine.mass)
    return min(max(math.ceil(phase / PHASE), 1), MOST_PIECES)


@compiled
def _point_speed(velocity: Vector, spin: Vector, at: Vector) -> float:
    return velocity[2] + spin[0] * at[1] - spin[1] * at[0]


@compiled
def _add_point(
    machine: ContactMachine, terms: np.ndarray, coefficients: np.ndarray, touch: np.ndarray, count: int, k: int,
    at: Vector, velocity: Vector, spin: Vector, target: float, tensor: Matrix,
) -> None:  # fmt: skip
    add_point(touch, count, k, at, tensor)
    touch[count, TARGET] = target
    touch[count, BEFORE] = _point_speed(velocity, spin, at)
    east = velocity[0] + spin[1] * at[2] - spin[2] * at[1]
    north = velocity[1] + spin[2] * at[0] - spin[0] * at[2]
    touch[count, FRICTION] = directed(terms, coefficients, machine.lateral_friction, east, north)


@compiled
def _kicked(
    machine: ContactMachine, body: Body, corners: np.ndarray, terms: np.ndarray, coefficients: np.ndarray,
    gravity: Vector, state: State, time: float, step: float, far: bool, settling: bool, tolerance: float,
    points: np.ndarray, touch: np.ndarray,
) -> tuple[Vector, Vector]:  # fmt: skip
    """Velocity and spin after the forces of a step and the impulses of points in touch, in its middle.

    A step of 0 is an impact of all points that are at the support.
    """
    position, q, velocity, spin = state
    impact, spring = step == 0, machine.contact_compliance_stiffness < math.inf
    near = tolerance if impact else 0.0 if spring else step * SLOW
    lowest = math.inf
    if not far or len(coefficients) > 0:
        lowest = heights(body, corners, position, q, points, MIDDLE)
    faster, turning = moved(velocity, step, gravity), spin
    if len(coefficients) > 0:
        faster = moved(faster, step, acceleration(terms, coefficients, position, velocity, lowest, time))
    if lowest >= near and body.isotropic:
        for k in range(len(points)):
            points[k, ACTIVE] = 0.0
        return faster, turning
    r, tensor = matrix(q), body.inverse
    if not body.isotropic:
        tensor, inertia = carried(r, body.inverse), carried(r, body.inertia)
        half = moved(spin, -0.5 * step, times(tensor, cross(spin, times(inertia, spin))))
        turning = moved(spin, -step, times(tensor, cross(half, times(inertia, half))))
    count = 0
    for k in range(len(points)):
        gap = points[k, MIDDLE]
        points[k, ACTIVE] = 0.0
        if lowest >= near or gap >= near:
            continue
        at = arm(body, corners, r, k)
        approach = _point_speed(velocity, spin, at)
        if impact:
            target = rebound(approach, machine.restitution)
            for axis in range(3):  # what a step's impulses were says nothing of an impact's
                points[k, IMPULSE + axis] = 0.0
        elif spring:
            target = -gap
        elif approach < -SLOW and not settling:
            continue  # an impact is to come
        else:
            target = min(-gap / step, SLOW)
        points[k, ACTIVE] = 1.0
        _add_point(machine, terms, coefficients, touch, count, k, at, velocity, spin, target, tensor)
        count += 1
    if count > 0:
        faster, turning = solve(machine, tensor, points, touch, count, faster, turning, spring, step)
    if impact:
        for k in range(len(points)):
            for axis in range(3):
                points[k, IMPULSE + axis] = 0.0
    return faster, turning


@compiled
def _first_hit(points: np.ndarray, tolerance: float, spring: bool) -> float:
    """The share of the try after which the first point that was not in touch is at the support; 2 if none is.

    A spring's point is in touch when it is below the support; a rigid one that hits is at it before it does.
    """
    share = 2.0
    for k in range(len(points)):
        gap, end = points[k, START], points[k, END]
        if end < -tolerance and (gap > tolerance if spring else points[k, ACTIVE] == 0):
            share = min(share, gap / (gap - end) if gap > tolerance else 0.0)
    return share


@compiled
def run(
    machine: ContactMachine, body: Body, corners: np.ndarray, terms: np.ndarray, coefficients: np.ndarray,
    first: np.ndarray, start: float, sample_time: float, substeps: int, points: np.ndarray, touch: np.ndarray,
    out: np.ndarray,
) -> None:  # fmt: skip
    """The motion from a state [13] at the time `start`, into `out` [T, 13]; both of the centre of the shape."""
    state = _read(body, first)
    spring = machine.contact_compliance_stiffness < math.inf
    longest = sample_time / substeps
    in_touch = longest / pieces(machine, longest)
    tolerance = TOUCH * body.reach
    varying = terms[3, 2] > 0
    ballistic = body.isotropic and len(coefficients) == 0
    gravity = tilted_gravity(machine.gravity, machine.support_tilt_roll, machine.support_tilt_pitch)
    lowest = heights(body, corners, state[0], state[1], points, START)
    for k in range(len(points)):
        for axis in range(3):
            points[k, IMPULSE + axis] = 0.0
    _write(body, state, out, 0)
    still = False
    for sample in range(1, len(out)):
        left, cut, events, impact = sample_time, math.inf, 0, False
        while left > 1e-9 * sample_time or impact:
            position, q, velocity, spin = state
            speed = abs(velocity[2]) + machine.gravity * left + body.reach * (abs(spin[0]) + abs(spin[1]))
            far = lowest > speed * left
            tried = min(left, cut, (math.inf if ballistic else longest) if far else in_touch) if not impact else 0.0
            middle = (moved(position, 0.5 * tried, velocity), turned(q, spin, 0.5 * tried), velocity, spin)
            time = start + sample * sample_time - left + 0.5 * tried
            settling = events == EVENTS  # it rattles: what still approaches is at rest
            velocity, spin = _kicked(
                machine, body, corners, terms, coefficients, gravity, middle, time, tried, far, settling, tolerance,
                points, touch,
            )  # fmt: skip
            position = moved(middle[0], 0.5 * tried, velocity)
            q = turned(middle[1], spin, 0.5 * tried)
            lower = heights(body, corners, position, q, points, END)
            share = 2.0 if far or impact or settling else _first_hit(points, tolerance, spring)
            if 0 < share < 2:
                cut = share * tried
                continue
            impact = share == 0
            if share == 2:
                state, lowest = (position, q, velocity, spin), lower
                left -= tried
                for k in range(len(points)):
                    points[k, START] = points[k, END]
                impact = cut < math.inf and lowest <= tolerance and not spring
            events += impact
            cut = math.inf
        _write(body, state, out, sample)
        if _slow(body, state) and not varying:
            if still:
                for later in range(sample + 1, len(out)):
                    _write(body, state, out, later)
                break
            still = True
        else:
            still = False


@compiled
def _slow(body: Body, state: State) -> bool:
    """Whether the body moves by no more than what rounding and unfinished sweeps leave."""
    _, _, velocity, spin = state
    return (
        max(abs(velocity[0]), abs(velocity[1]), abs(velocity[2])) < STILL
        and body.reach * max(abs(spin[0]), abs(spin[1]), abs(spin[2])) < STILL
    )


@compiled
def _read(body: Body, row: np.ndarray) -> State:
    """The state of the centre of mass."""
    q, spin = (row[3], row[4], row[5], row[6]), (row[10], row[11], row[12])
    offset = times(matrix(q), body.center)
    place, speed = (row[0], row[1], row[2]), (row[7], row[8], row[9])
    return moved(place, -1.0, offset), q, moved(speed, -1.0, cross(spin, offset)), spin


@compiled
def _write(body: Body, state: State, out: np.ndarray, sample: int) -> None:
    """Pose and velocities of the centre of the shape."""
    position, q, velocity, spin = state
    offset = times(matrix(q), body.center)
    out[sample, 0], out[sample, 1], out[sample, 2] = moved(position, 1.0, offset)
    out[sample, 3], out[sample, 4], out[sample, 5], out[sample, 6] = q
    out[sample, 7], out[sample, 8], out[sample, 9] = moved(velocity, 1.0, cross(spin, offset))
    out[sample, 10], out[sample, 11], out[sample, 12] = spin
