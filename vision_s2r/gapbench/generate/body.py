"""A body on a plane as the benchmark moves it: code and scheme of its own.

Semi-implicit Euler at a tenth of a millisecond, less where a point arrives or pushes on a spring; the impulses of all
points that touch are found together, on the matrix of what each of their impulses does to each of their velocities
(Delassus), by gradient steps with momentum that are projected on the friction cones (Nesterov 1983); torques against
rolling and spinning are rows of that matrix beside the points', so that what they take leaves each point's law of
impact intact.
"""

import math
from typing import NamedTuple

import numba
import numpy as np

from vision_s2r.gapbench.generate.compiled import helper

FINE, COARSE = 1e-4, 4e-4  # s: steps for recordings, to measure a severity, at most
PHASE = 0.03  # rad of a spring's oscillation that a fine step in touch goes through, at most
INTO = 1e-6  # s after a point's arrival that a step ends
SLOW = 0.02  # m/s: slower arrivals do not rebound
ROUNDS, TRIES = 3, 15  # of friction bounds, and of gradient steps in each
MOST = 8  # points that touch


class TossedBody(NamedTuple):
    """A body, its support and what acts on it; SI units."""

    mass: float
    friction: float
    restitution: float
    gravity: float = 9.81
    rolling: float = 0.0  # m
    spinning: float = 0.0  # m
    stiffness: float = 0.0  # N/m of each point; 0: rigid
    damping: float = 0.0  # N·s/m
    center_x: float = 0.0  # m, of mass, from the shape's centre
    center_y: float = 0.0
    center_z: float = 0.0
    rounding: float = 0.0  # m, radius of a box's edges and corners
    roll: float = 0.0  # rad, of the support
    pitch: float = 0.0
    # What no library knows
    drag: float = 0.0  # 1/s: force per mass and speed
    quadratic_drag: float = 0.0  # 1/m: and per square of the speed
    adhesion: float = 0.0  # m/s²: a pull per mass on a body whose lowest point is nearer than …
    adhesion_reach: float = 1e-3  # m
    uneven: float = 0.0  # share by which friction is larger along …
    uneven_angle: float = 0.0  # rad
    wind: float = 0.0  # m/s²: a fan's, of air that blows towards …
    wind_angle: float = 0.0  # rad
    wind_place: float = 0.0  # m along it, the middle of where it blows
    wind_width: float = 1.0  # m
    patch: float = 0.0  # share by which friction differs beyond …
    patch_place: float = 0.0  # m in x
    fade: float = 0.0  # 1/s: growth of the friction with time
    hastening: float = 0.0  # s/m: growth of the friction with the speed of sliding
    lively: float = 0.0  # share of what a rebound could be more that it is, beyond patch_place
    lift: float = 0.0  # 1/rad: Magnus force per mass, spin and speed
    spin_drag: float = 0.0  # 1/s: torque of the air, of the inertia and spin
    film: float = 0.0  # 1/s: force per mass and speed of the air that a body squeezes out nearer than …
    film_reach: float = 0.01  # m
    magnet: float = 0.0  # m/s²: a pull towards a place under the support, at its largest, at …
    magnet_x: float = 0.0  # m
    magnet_y: float = 0.0
    magnet_depth: float = 0.1  # m


FIELDS = TossedBody._fields


@helper
def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@helper
def _put(values: np.ndarray, at: int, new: np.ndarray) -> None:
    """These numbers from there on: a slice would have an error message compiled, too."""
    for k in range(len(new)):
        values[at + k] = new[k]


@helper
def _rotation(q: np.ndarray) -> np.ndarray:
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@helper
def _turn(q: np.ndarray, spin: np.ndarray, time: float) -> np.ndarray:
    rate = math.sqrt(spin[0] ** 2 + spin[1] ** 2 + spin[2] ** 2)
    half = 0.5 * rate * time
    share = 0.5 * time if rate < 1e-12 else math.sin(half) / rate
    d = math.cos(half)
    vector = d * q[:3] + q[3] * share * spin + share * _cross(spin, q[:3])
    scalar = d * q[3] - share * (spin[0] * q[0] + spin[1] * q[1] + spin[2] * q[2])
    out = np.array([vector[0], vector[1], vector[2], scalar])
    return out / math.sqrt((out**2).sum())


@helper
def _friction(body: TossedBody, place: float, time: float, vx: float, vy: float) -> float:
    value = body.friction * (1 + body.fade * time)
    if place > body.patch_place:
        value *= 1 + body.patch
    if body.uneven != 0 and vx * vx + vy * vy > 1e-12:
        value *= 1 + body.uneven * math.cos(2 * (math.atan2(vy, vx) - body.uneven_angle))
    return value * (1 + body.hastening * math.sqrt(vx * vx + vy * vy))


@helper
def _forces(
    body: TossedBody, position: np.ndarray, velocity: np.ndarray, spin: np.ndarray, lowest: float
) -> np.ndarray:
    """Acceleration of the centre of mass."""
    g = body.gravity
    speed = math.sqrt((velocity**2).sum())
    out = np.array(
        [
            g * math.sin(body.pitch),
            -g * math.cos(body.pitch) * math.sin(body.roll),
            -g * math.cos(body.pitch) * math.cos(body.roll),
        ]
    )
    out -= (body.drag + body.quadratic_drag * speed) * velocity
    if lowest < body.adhesion_reach:
        out[2] -= body.adhesion
    if body.wind != 0:
        c, s = math.cos(body.wind_angle), math.sin(body.wind_angle)
        along = (position[0] * c + position[1] * s - body.wind_place) / body.wind_width
        out[0] += body.wind * c * math.exp(-(along**2))
        out[1] += body.wind * s * math.exp(-(along**2))
    if body.lift != 0:
        out += body.lift * _cross(spin, velocity)
    if body.film != 0:
        out[2] -= body.film * velocity[2] * math.exp(-max(lowest, 0.0) / body.film_reach)
    if body.magnet != 0:
        away = position - np.array([body.magnet_x, body.magnet_y, -body.magnet_depth])
        distance = math.sqrt((away**2).sum()) / body.magnet_depth
        out -= body.magnet / body.magnet_depth / distance**4 * away
    return out


@helper
def _shorten(values: np.ndarray, at: int, most: float) -> None:
    """Two neighbours, a vector in the plane, to no more than this length."""
    size = math.sqrt(values[at] ** 2 + values[at + 1] ** 2)
    if size > most:
        values[at] *= most / size
        values[at + 1] *= most / size


@helper
def _impulses(
    delassus: np.ndarray, free: np.ndarray, target: np.ndarray, friction: np.ndarray, rolling: float, spinning: float
) -> np.ndarray:
    """Impulses so that normal velocities reach their targets, or are above without impulse; in friction cones.

    Of n points [3·n], and where there are three rows more, torques about x, y and z that are bounded by these shares
    of the sum of the normal impulses.
    """
    count, rows = len(target), len(free)
    wanted = free.copy()
    for i in range(count):
        wanted[3 * i + 2] -= target[i]
    bound = 0.0
    for i in range(rows):
        bound = max(bound, np.abs(delassus[i]).sum())
    impulses, ahead = np.zeros(rows), np.zeros(rows)
    for _ in range(ROUNDS):
        limits = np.array([friction[i] * max(impulses[3 * i + 2], 0.0) for i in range(count)])
        pressed = impulses[2 : 3 * count : 3].sum()
        momentum = 1.0
        for _ in range(TRIES * count):
            gradient = delassus @ ahead + wanted
            new = ahead - gradient / bound
            total = 0.0
            for i in range(count):
                normal = max(new[3 * i + 2], 0.0)
                new[3 * i + 2] = normal
                total += normal
                _shorten(
                    new, 3 * i, friction[i] * normal if limits[i] == 0 else 0.5 * (limits[i] + friction[i] * normal)
                )
            if rows > 3 * count:
                total = total if pressed == 0 else 0.5 * (pressed + total)
                _shorten(new, 3 * count, rolling * total)
                new[-1] = min(max(new[-1], -spinning * total), spinning * total)
            if ((new - impulses) @ gradient) > 0:
                momentum = 1.0
            following = 0.5 * (1 + math.sqrt(1 + 4 * momentum * momentum))
            ahead = new + (momentum - 1) / following * (new - impulses)
            change = np.abs(new - impulses).max()
            impulses, momentum = new, following
            if change < 1e-7:
                break
    return impulses


@numba.njit(cache=True, nogil=True)
def move(
    body: TossedBody,
    points: np.ndarray,
    radius: float,
    inertia: np.ndarray,
    first: np.ndarray,
    samples: int,
    sample_time: float,
    longest: float,
) -> np.ndarray:
    """States [samples, 13] of the shape's centre from a first one; a box's corners [8, 3], or none and a radius.

    The inertia is that of unit mass; steps are `longest` (s) at most.
    """
    center = np.array([body.center_x, body.center_y, body.center_z])
    q, spin = first[3:7].copy(), first[10:13].copy()
    offset = _rotation(q) @ center
    position = first[:3] + offset
    velocity = first[7:10] + _cross(spin, offset)
    ball = len(points) == 0
    number = 1 if ball else len(points)
    arms, gaps = np.empty((number, 3)), np.empty(number)
    jacobian, levers = np.zeros((3 * MOST + 3, 3)), np.zeros((3 * MOST + 3, 3))
    out = np.empty((samples, 13))
    rigid = body.stiffness == 0
    # In touch with a spring, a small part of its oscillation on all points.
    firm = longest if rigid else min(longest, longest / FINE * PHASE / math.sqrt(4 * body.stiffness / body.mass))
    for sample in range(samples):
        offset = _rotation(q) @ center
        row = out[sample]
        _put(row, 0, position - offset)
        _put(row, 3, q)
        _put(row, 7, velocity - _cross(spin, offset))
        _put(row, 10, spin)
        left = sample_time
        while left > 1e-9 * sample_time:
            r = _rotation(q)
            for k in range(number):
                if ball:
                    _put(arms[k], 0, -(r @ center))
                    arms[k, 2] -= radius
                else:
                    _put(arms[k], 0, r @ (points[k] - body.rounding * np.sign(points[k]) - center))
                    arms[k, 2] -= body.rounding
                gaps[k] = position[2] + arms[k, 2]
            lowest = gaps.min()
            step = min(left, longest if rigid or lowest >= 0 else firm, _arrival(arms, gaps, velocity, spin, longest))
            forces = _forces(body, position, velocity, spin, lowest)
            velocity = velocity + step * forces
            world = r @ inertia @ r.T
            inverse = np.linalg.inv(world)
            spin = spin - step * (inverse @ _cross(spin, world @ spin)) - step * body.spin_drag * spin
            mean = velocity - 0.5 * step * forces
            if lowest < 0:
                time = (sample + 1) * sample_time - left
                velocity, spin = _touched(
                    body, arms, gaps, inverse, velocity, spin, position[0], time, step, jacobian, levers
                )
                mean = velocity
            position = position + step * mean
            q = _turn(q, spin, step)
            left -= step
    return out


@helper
def _arrival(arms: np.ndarray, gaps: np.ndarray, velocity: np.ndarray, spin: np.ndarray, longest: float) -> float:
    """The time, if less than a step, in which the first point that approaches will just have arrived."""
    soonest = longest
    for k in range(len(gaps)):
        approach = -(velocity[2] + spin[0] * arms[k, 1] - spin[1] * arms[k, 0])
        if gaps[k] >= 0 and approach > SLOW:
            soonest = min(soonest, gaps[k] / approach + INTO)
    return soonest


@helper
def _touched(
    body: TossedBody,
    arms: np.ndarray,
    gaps: np.ndarray,
    inverse: np.ndarray,
    velocity: np.ndarray,
    spin: np.ndarray,
    place: float,
    time: float,
    step: float,
    jacobian: np.ndarray,
    levers: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and spin after the impulses of the points that are below the support."""
    count = 0
    target, friction, depth = np.zeros(MOST), np.zeros(MOST), np.zeros(MOST)
    free = np.zeros(3 * MOST + 3)
    for k in range(len(gaps)):
        if gaps[k] >= 0 or count == MOST:
            continue
        x, y, z = arms[k]
        speed = velocity + _cross(spin, arms[k])
        _put(free, 3 * count, speed)
        _put(jacobian[3 * count], 0, (0.0, z, -y))
        _put(jacobian[3 * count + 1], 0, (-z, 0.0, x))
        _put(jacobian[3 * count + 2], 0, (y, -x, 0.0))
        restitution = body.restitution + (body.lively * (1 - body.restitution) if place > body.patch_place else 0.0)
        target[count] = -restitution * speed[2] if speed[2] < -SLOW else min(-0.02 * gaps[k] / step, 0.05)
        friction[count] = _friction(body, place, time, speed[0], speed[1])
        depth[count] = -gaps[k]
        count += 1
    rigid = body.stiffness == 0
    rows = 3 * count
    length = math.sqrt(3 / (inverse[0, 0] + inverse[1, 1] + inverse[2, 2]))  # m: makes a torque as large as a force
    if rigid and (body.rolling > 0 or body.spinning > 0):
        for axis in range(3):
            _put(jacobian[rows + axis], 0, (0.0, 0.0, 0.0))
            jacobian[rows + axis, axis] = length
        _put(free, rows, length * spin)
        rows += 3
    delassus = np.zeros((rows, rows))
    for i in range(3 * count):
        for j in range(3 * count):
            if i % 3 == j % 3:
                delassus[i, j] = 1.0
    for i in range(rows):
        _put(levers[i], 0, inverse @ jacobian[i])
    for i in range(rows):
        for j in range(rows):
            delassus[i, j] += (jacobian[i] * levers[j]).sum()
    if not rigid:
        impulses = np.zeros(3 * count)
        for i in range(count):
            approach = -free[3 * i + 2]
            firm = body.damping * (1 + body.restitution) if approach > 0 else body.damping
            normal = max(0.0, step / body.mass * (body.stiffness * depth[i] + firm * approach))
            impulses[3 * i + 2] = normal
            # Friction brings the point to rest if it may.
            stop = 1 / max(delassus[3 * i, 3 * i], delassus[3 * i + 1, 3 * i + 1]) / count
            x, y = -stop * free[3 * i], -stop * free[3 * i + 1]
            size, limit = math.sqrt(x * x + y * y), friction[i] * normal
            share = min(1.0, limit / size) if size > 0 else 0.0
            impulses[3 * i], impulses[3 * i + 1] = share * x, share * y
    else:
        impulses = _impulses(
            delassus, free[:rows], target[:count], friction[:count], body.rolling / length, body.spinning / length
        )
    total = 0.0
    for i in range(count):
        velocity = velocity + impulses[3 * i : 3 * i + 3]
        total += impulses[3 * i + 2]
    for i in range(len(impulses)):
        spin = spin + impulses[i] * levers[i]
    return velocity, spin if rigid else _braked(body, inverse, spin, total)


@helper
def _braked(body: TossedBody, inverse: np.ndarray, spin: np.ndarray, total: float) -> np.ndarray:
    """The spin after the torques of a step on springs, whose forces the step's velocities do not change."""
    flat = math.sqrt(spin[0] ** 2 + spin[1] ** 2)
    if body.rolling > 0 and flat > 0:
        ease = max(inverse[0, 0], inverse[1, 1])
        brake = min(body.rolling * total, flat / ease)
        spin = spin - inverse @ np.array([spin[0], spin[1], 0.0]) * (brake / flat)
    if body.spinning > 0 and spin[2] != 0:
        brake = min(body.spinning * total, abs(spin[2]) / inverse[2, 2])
        spin = spin - inverse @ np.array([0.0, 0.0, math.copysign(brake, spin[2])])
    return spin
