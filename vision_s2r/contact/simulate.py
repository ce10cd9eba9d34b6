"""Simulate many machines over many starts: compiled, in parallel, the same bits whatever the number of threads."""

import hashlib
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numba
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vision_s2r.contact.lanes import LANES, align_stack
from vision_s2r.contact.machine import COLUMNS
from vision_s2r.contact.motion import Clock, run
from vision_s2r.contact.points import points_of
from vision_s2r.contact.room import STATE, ConvexSolid, Room, rooms_of
from vision_s2r.contact.shape import Shape
from vision_s2r.contact.terms import NO_TERMS, Terms
from vision_s2r.errors import UserError
from vision_s2r.shares import in_shares

STEP = 0.0015  # s; the default step is the longest below it that divides the sample time
WORTH_THREADS = 60_000  # steps; less than this is over before threads have started

_WIDTH = len(COLUMNS)
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
    machines = np.require(machines, np.float64, _PLAIN)
    # Without a −0, and no sum makes one of others, a lane is the same bits whether 0 is added to it or nothing.
    first = np.add(first, 0.0, dtype=np.float64, order="C")
    starts = np.zeros(len(first)) if starts is None else np.require(starts, np.float64, _PLAIN)
    table, width = terms.array(), terms.width
    _check(machines, first, starts, samples, sample_time, width, substeps)
    steps = substeps or max(1, math.ceil(sample_time / STEP - 1e-9))
    out = np.empty((len(machines), len(first), samples, STATE))
    jobs = len(machines) * len(first)
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if jobs * samples * steps >= WORTH_THREADS else 1
    threads = max(1, min(threads, -(-jobs // LANES)))  # lanes that are empty cost as much
    corners, inward = (np.require(x, np.float64, _PLAIN) for x in points_of(shape))
    ball, edged = shape.kind == "sphere", shape.kind in ("box", "mesh")
    solid = (
        shape.kind == "cylinder",
        shape.radius if ball else 0.0,
        shape.depth if edged else 0.0,
        shape.isotropic,
        shape.reach,
        shape.inertia.ravel(),
        shape.inverse.ravel(),
    )
    order = np.argsort(first[:, 2], kind="stable")  # by height: about by when they hit
    inputs = (first, starts, order, float(sample_time), steps, table)
    out[:, :, 0] = first
    if samples == 1:
        return out

    def share(k: int) -> None:
        _kernel(machines, corners, inward, *solid, *inputs, k, threads, *rooms_of(shape.contacts, width), out)

    in_shares(share, threads)
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
        of_shape: np.ndarray,
        inward: np.ndarray,
        rims: bool,
        radius: float,
        depth: float,
        isotropic: bool,
        reach: float,
        inertia: np.ndarray,
        inverse: np.ndarray,
        first: np.ndarray,
        starts: np.ndarray,
        order: np.ndarray,
        sample_time: float,
        substeps: int,
        terms: np.ndarray,
        share: int,
        shares: int,
        machine: np.ndarray,
        coefficients: np.ndarray,
        given: np.ndarray,
        corners: np.ndarray,
        points: np.ndarray,
        touch: np.ndarray,
        shown: np.ndarray,
        out: np.ndarray,
    ) -> None:
        sources  # noqa: B018
        align_stack()
        tensors = (to_fixed_tuple(inertia, 9), to_fixed_tuple(inverse, 9))  # type: ignore[call-arg]
        solid = ConvexSolid(rims, radius, depth, isotropic, reach, *tensors)
        clock = Clock(sample_time, sample_time / substeps, out.shape[2] - 1)
        flat = Room(machine, coefficients, given, corners, points, touch, shown)
        run(machines, solid, of_shape, inward, first, starts, order, clock, terms, share, shares, flat, out)

    return kernel


def digest() -> str:
    """Of all the code in this room."""
    folder = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


_kernel = _compile(digest())
