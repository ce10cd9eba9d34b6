"""Simulate many machines over many starts: compiled, in parallel, the same bits whatever the number of threads."""

import hashlib
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import numba
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vision_s2r.contact.impulses import POINTS_WIDTH, TOUCH_WIDTH
from vision_s2r.contact.machine import COLUMNS, ContactMachine
from vision_s2r.contact.motion import run
from vision_s2r.contact.points import KINDS, Body
from vision_s2r.contact.shape import Shape
from vision_s2r.contact.terms import NO_TERMS, Terms
from vision_s2r.errors import UserError

STATE = 13  # position, attitude (x, y, z, w), velocity, spin
STEP = 0.0015  # s; the default step is the longest below it that divides the sample time
MOST_ROUND = 0.95  # of the body's depth: corners are no rounder than that
WORTH_THREADS = 20_000  # steps; less than this is over before threads have started

_WIDTH = len(COLUMNS)
_CENTER = COLUMNS.index("center_of_mass.x")
_PLAIN: Final = ("C", "W")  # of arrays: one type, so that the kernel is compiled once


def simulate(
    machines: np.ndarray,
    shape: Shape,
    first: np.ndarray,
    samples: int,
    sample_time: float,
    *,
    starts: np.ndarray | None = None,
    substeps: int | None = None,
    terms: Terms = NO_TERMS,
    threads: int | None = None,
) -> np.ndarray:
    """States [C, W, T, 13] of the centre of a shape: m, unit quaternion x y z w, m/s and rad/s, in the support's frame.

    machines [C, P]   rows of `pack`; with `terms` their coefficients behind, [C, P + terms.width]
    first [W, 13]     the state at each start
    samples           T, the first included
    sample_time       s between samples
    starts [W]        s since the beginning of the episode, 0 by default: for terms of time
    substeps          steps a sample near the support; by default as many as keep them at 1.5 ms or less
    threads           by default as many as the machine has, for work that is worth it

    Raises UserError for shapes that do not fit, and values that cannot be.
    """
    machines, first = (np.require(x, np.float64, _PLAIN) for x in (machines, first))
    starts = np.zeros(len(first)) if starts is None else np.require(starts, np.float64, _PLAIN)
    _check(machines, first, starts, samples, sample_time, terms.width, substeps)
    steps = substeps or max(1, math.ceil(sample_time / STEP - 1e-9))
    out = np.empty((len(machines), len(first), samples, STATE))
    jobs = len(machines) * len(first)
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if jobs * samples * steps >= WORTH_THREADS else 1
    threads = max(1, min(threads, jobs))
    corners = np.require(shape.points, np.float64, _PLAIN)
    round_body = (shape.radius, shape.half_length, shape.inertia.ravel(), np.linalg.inv(shape.inertia).ravel())
    isotropic = bool(np.ptp(np.linalg.eigvalsh(shape.inertia)) < 1e-9 * np.trace(shape.inertia))
    body = (
        KINDS[shape.kind],
        corners,
        np.require(shape.inward, np.float64, _PLAIN),
        shape.depth,
        *round_body,
        isotropic,
        shape.reach,
    )
    inputs = (first, starts, float(sample_time), steps, terms.array())

    def share(k: int) -> None:
        room = (np.empty_like(corners), *(np.zeros((shape.contacts, width)) for width in (POINTS_WIDTH, TOUCH_WIDTH)))
        _kernel(machines, *body, *inputs, k, threads, *room, out)

    if threads == 1:
        share(0)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(share, range(threads)))
    return out


def _check(
    machines: np.ndarray,
    first: np.ndarray,
    starts: np.ndarray,
    samples: int,
    sample_time: float,
    coefficients: int,
    substeps: int | None,
) -> None:
    if machines.ndim != 2 or machines.shape[1] != _WIDTH + coefficients:
        raise UserError(f"machines are {machines.shape}, expected [C, {_WIDTH + coefficients}]")
    if first.ndim != 2 or first.shape[1] != STATE or starts.shape != (len(first),):
        raise UserError(f"first is {first.shape} and starts {starts.shape}, expected [W, {STATE}] and [W]")
    if np.isnan(machines).any() or not np.isfinite(first).all():
        raise UserError("a machine or a first state is not a number")
    if not 0 < sample_time < math.inf or samples < 1 or (substeps is not None and substeps < 1):
        raise UserError(f"sample_time {sample_time}, samples {samples}, substeps {substeps}: expected more than 0")


def _compile(sources: str) -> Callable[..., Any]:
    """The kernel. `sources`, a digest of this room's code, is part of what numba's cache knows it by."""

    # Nothing is allocated in there, and so no reference need be counted.
    @numba.njit(nogil=True, error_model="numpy", cache=True, _nrt=False)  # type: ignore[call-overload]
    def kernel(
        machines: np.ndarray,
        kind: int,
        of_shape: np.ndarray,
        inward: np.ndarray,
        depth: float,
        radius: float,
        half_length: float,
        inertia: np.ndarray,
        inverse: np.ndarray,
        isotropic: bool,
        reach: float,
        first: np.ndarray,
        starts: np.ndarray,
        sample_time: float,
        substeps: int,
        terms: np.ndarray,
        share: int,
        shares: int,
        corners: np.ndarray,
        points: np.ndarray,
        touch: np.ndarray,
        out: np.ndarray,
    ) -> None:
        sources  # noqa: B018
        windows = len(first)
        for job in range(share, len(machines) * windows, shares):
            c, w = divmod(job, windows)
            row = machines[c]
            machine = ContactMachine(*to_fixed_tuple(row, _WIDTH))  # type: ignore[call-arg]
            x, y, z = row[_CENTER], row[_CENTER + 1], row[_CENTER + 2]
            rounding = min(machine.corner_radius_value, MOST_ROUND * depth)
            for k in range(len(corners)):
                for axis in range(3):
                    corners[k, axis] = of_shape[k, axis] + rounding * inward[k, axis] - row[_CENTER + axis]
            body = Body(
                kind,
                rounding,
                (-x, -y, -z),
                radius,
                half_length,
                to_fixed_tuple(inertia, 9),
                to_fixed_tuple(inverse, 9),
                isotropic,
                reach + math.sqrt(x * x + y * y + z * z),
            )
            motion = (first[w], starts[w], sample_time, substeps)
            run(machine, body, corners, terms, row[_WIDTH:], *motion, points, touch, out[c, w])

    return kernel


def digest() -> str:
    """Of all the code in this room."""
    folder = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


_kernel = _compile(digest())
