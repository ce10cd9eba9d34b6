"""A generated position servo in a free run: targets that jitter, a profile, and the law inside the integrator.

The law is worked out in every slope of the integrator, whose steps are cut where a target arrives or a row is logged.
A profile is that of Han's discrete time-optimal control of a double integrator (From PID to active disturbance
rejection control, 2009), in steps of 25 µs.
"""

import numpy as np
from numba import njit

from vision_s2r.gapbench.generate.compiled import helper
from vision_s2r.gapbench.generate.drive import INF, DriveModel, advance, started

PROFILE_STEP = 2.5e-5  # s


@helper
def _time_optimal(error: float, rate: float, most: float, step: float) -> float:
    """The acceleration, of `most` at most, that brings an error and its rate to 0 soonest."""
    reach = most * step * step
    glide = step * rate
    ahead = error + glide
    root = np.sqrt(reach * (reach + 8 * abs(ahead)))
    far = glide + np.sign(ahead) * (root - reach) / 2
    near = (np.sign(ahead + reach) - np.sign(ahead - reach)) / 2
    switch = (glide + ahead - far) * near + far
    inner = (np.sign(switch + reach) - np.sign(switch - reach)) / 2
    return -most * (switch / reach - np.sign(switch)) * inner - most * np.sign(switch)


@helper
def _profile(place: float, rate: float, target: float, time: float, p: DriveModel) -> tuple[float, float]:
    """Set point and its rate after so long on its way to a target."""
    steps = int(np.ceil(time / PROFILE_STEP))
    step = time / steps
    for _ in range(steps):
        if p.acceleration_limit < INF:
            change = step * _time_optimal(place - target, rate, p.acceleration_limit, step)
            later = min(max(rate + change, -p.velocity_limit), p.velocity_limit)
            place += step * (rate + later) / 2
            rate = later
        else:
            most = step * p.velocity_limit
            place += min(max(target - place, -most), most)
    return place, rate


@njit(cache=True, nogil=True)
def run_servo(p: DriveModel, targets: np.ndarray, times: np.ndarray, start: float, step: float) -> np.ndarray:
    """Free run from rest at `start` (rad): the load's position, as an encoder without steps shows it, and rate [T, 2].

    Row k is the state at times[k] (s, increasing, of at least 2 rows), when target k (rad) is sent; it arrives after
    the delay, and holds until the next one does.
    """
    samples = len(targets)
    rows = np.empty((samples, 2))
    y, direction, side = started(p, np.array([start, 0.0]))
    profiled = p.velocity_limit < INF or p.acceleration_limit < INF
    t, row, sent = times[0], 0, -1
    place, rate = start, 0.0
    while True:
        while row < samples and times[row] <= t + 1e-12:
            rows[row, 0], rows[row, 1] = y[2], y[3]
            row += 1
        if row == samples:
            return rows
        while sent + 1 < samples and times[sent + 1] + p.delay <= t + 1e-12:
            sent += 1
        until = times[row]
        if sent + 1 < samples:
            until = min(until, times[sent + 1] + p.delay)
        target = targets[sent] if sent >= 0 else start
        steps = int(np.ceil((until - t) / step))
        h = (until - t) / steps
        for k in range(steps):
            if profiled:
                middle = _profile(place, rate, target, h / 2, p)
                place, rate = _profile(middle[0], middle[1], target, h / 2, p)
                point = middle[0]
            else:
                point = target
            y, direction, side = advance(t + k * h, y, h, point, direction, side, p)
        t = until
