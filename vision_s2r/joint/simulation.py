"""Simulate many machines over many episodes: compiled, in parallel, the same bits whatever the number of threads."""

import hashlib
import inspect
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numba
import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.joint.clock import clocked_one_mass, clocked_two_masses
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import steady
from vision_s2r.joint.effect import JOINT_EFFECTS
from vision_s2r.joint.effects.encoder_quantization import quantize
from vision_s2r.joint.log import JointLog
from vision_s2r.joint.machine import COLUMNS, check, machine_at, of_gains
from vision_s2r.joint.one_mass import one_mass
from vision_s2r.joint.pointer import pointer
from vision_s2r.joint.tables import Tables
from vision_s2r.joint.two_masses import two_masses
from vision_s2r.shares import in_shares

STEP = 0.002  # s; the default step is the longest below it that divides the sample time
WORTH_THREADS = 500_000  # steps; less than this is over before threads have started

_WIDTH = len(COLUMNS)
_SERVO = COLUMNS.index("proportional_gain")
PARTED = ("external", "load_inertia")  # of which a sample may have several values
_NO_TABLES = Tables()
_PLAIN: Final = ("C", "W")  # of arrays: one type, so that the kernel is compiled once


def simulate(
    machines: np.ndarray,
    command: np.ndarray,
    first: np.ndarray,
    sample_time: float,
    *,
    times: np.ndarray | None = None,
    scale: np.ndarray | None = None,
    external: np.ndarray | None = None,
    load_inertia: np.ndarray | None = None,
    gains: np.ndarray | None = None,
    lengths: np.ndarray | None = None,
    observed: np.ndarray | None = None,
    leak: float = 0.0,
    substeps: int | None = None,
    tables: Tables | None = None,
    threads: int | None = None,
) -> np.ndarray:
    """Positions and velocities [C, E, T, 2] float64 (rad, rad/s, or m, m/s) that the encoder shows.

    machines [C, P]   rows of `pack`; with `tables` the heights of their knots behind, [C, P + tables.width]
    command [E, T]    current (A), or torque or force where the torque constant is 1, or a position servo's target
                      (rad, m); held between samples
    first [E, 2]      position and velocity at the first sample
    sample_time       s between samples
    times [E, T]      s of each sample, rising, where they are not even; only differences count
    scale [E, T]      factor of the current (a supply that sags, 0 where the drive is off); held between samples
    external [E, T·S]   torque (N·m, N) on the load; S values a sample, held for an equal part of it each
    load_inertia [E, T·S]   kg·m² (kg), 0 or more, added to the machine's inertia; alike, of as many parts
    gains [E]         factor of both gains of a position servo in each episode
    lengths [E]       samples of each episode, T by default; rows beyond are NaN
    observed [E, T, 2], leak    an observer: at each sample `leak` times (observed - simulated) is added to the
                      simulated state, after its row is written, so that the row is a prediction. Where observed is
                      NaN nothing is added. leak = 0 simulates freely.
    substeps          integration steps a sample; by default as many as keep them at 2 ms or less, and one where
                      that is exact: no torque varies between samples, and no play or spring divides the joint
    threads           by default as many as the machine has, for work that is worth it

    Row k is the state at sample k, before command k acts. Play starts in its middle, a spring untwisted; latency
    begins with no command (0), or a servo's first position. Raises UserError for shapes that do not fit, and where
    servos and others are mixed.
    """
    given = prepared(
        machines, command, first, sample_time, times=times, scale=scale, external=external,
        load_inertia=load_inertia, gains=gains, lengths=lengths, observed=observed, leak=leak, substeps=substeps,
        tables=tables,
    )  # fmt: skip
    episodes, samples = given.command.shape
    out = np.full((len(given.machines), episodes, samples, 2), np.nan)
    jobs = len(given.machines) * episodes
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if jobs * samples * given.substeps >= WORTH_THREADS else 1
    threads = max(1, min(threads, jobs))

    def share(k: int) -> None:
        _kernel(given, substeps is None, k, threads, out)

    in_shares(share, threads)
    return out


class Prepared(NamedTuple):
    """What a kernel is given: inputs in the types that it is compiled for, shapes and values checked."""

    machines: np.ndarray
    command: np.ndarray
    first: np.ndarray
    gains: np.ndarray
    sample_time: float
    lengths: np.ndarray
    observed: np.ndarray  # [E, 0, 2] where leak is 0
    leak: float
    times: np.ndarray  # [E, 0], as what follows, where there is none
    scale: np.ndarray
    external: np.ndarray
    load_inertia: np.ndarray
    substeps: int
    tables: np.ndarray  # `Tables.array`


def prepared(
    machines: np.ndarray,
    command: np.ndarray,
    first: np.ndarray,
    sample_time: float,
    *,
    times: np.ndarray | None = None,
    scale: np.ndarray | None = None,
    external: np.ndarray | None = None,
    load_inertia: np.ndarray | None = None,
    gains: np.ndarray | None = None,
    lengths: np.ndarray | None = None,
    observed: np.ndarray | None = None,
    leak: float = 0.0,
    substeps: int | None = None,
    tables: Tables | None = None,
) -> Prepared:
    """The inputs of `simulate`. Raises UserError as it does."""
    layout = tables or _NO_TABLES
    machines, command, first = (np.require(x, np.float64, _PLAIN) for x in (machines, command, first))
    episodes, samples = _check(machines, command, first, sample_time, layout.width)
    lengths = np.full(episodes, samples) if lengths is None else np.require(lengths, np.int64, _PLAIN)
    if lengths.shape != (episodes,) or (episodes and not 0 <= lengths.min() <= lengths.max() <= samples):
        raise UserError(f"lengths {lengths}: expected {episodes} numbers from 0 to {samples}")
    if observed is None or leak == 0:
        observed, leak = np.empty((episodes, 0, 2)), 0.0
    elif observed.shape != (episodes, samples, 2):
        raise UserError(f"observed is {observed.shape}, expected {(episodes, samples, 2)}")
    observed = np.require(observed, np.float64, _PLAIN)
    if substeps is not None and substeps < 1:
        raise UserError(f"substeps is {substeps}, expected 1 or more")
    steps = substeps or max(1, math.ceil(sample_time / STEP - 1e-9))
    gains = np.ones(episodes) if gains is None else np.require(gains, np.float64, _PLAIN)
    if gains.shape != (episodes,):
        raise UserError(f"gains are {gains.shape}, expected {(episodes,)}")
    inputs = (command, first, gains, float(sample_time), lengths, observed, float(leak))
    at, factor, pull, heavier = _clock(machines, command, sample_time, lengths, times, scale, external, load_inertia)
    return Prepared(machines, *inputs, at, factor, pull, heavier, steps, layout.array())


def _check(
    machines: np.ndarray, command: np.ndarray, first: np.ndarray, sample_time: float, heights: int
) -> tuple[int, int]:
    if machines.ndim != 2 or machines.shape[1] != _WIDTH + heights:
        raise UserError(f"machines are {machines.shape}, expected [C, {_WIDTH + heights}]")
    if command.ndim != 2 or first.shape != (len(command), 2):
        raise UserError(f"command is {command.shape} and first {first.shape}, expected [E, T] and [E, 2]")
    check(machines[:, :_WIDTH])
    if not 0 < sample_time < math.inf:
        raise UserError(f"sample_time is {sample_time}, expected seconds, more than 0")
    return command.shape[0], command.shape[1]


def _clock(
    machines: np.ndarray,
    command: np.ndarray,
    sample_time: float,
    lengths: np.ndarray,
    times: np.ndarray | None,
    scale: np.ndarray | None,
    external: np.ndarray | None,
    load_inertia: np.ndarray | None,
) -> tuple[np.ndarray, ...]:
    """Times and the inputs beside the command [E, T], each [E, 0] where there is none; no times: samples rule steps."""
    servo = ~np.isnan(machines[:, _SERVO])
    if servo.any() and not servo.all():
        raise UserError("some machines are position servos and some are not, expected all of one kind")
    others = {"scale": scale, "external": external, "load_inertia": load_inertia}
    if times is None and (servo.any() or any(values is not None for values in others.values())):
        times = np.broadcast_to(np.arange(command.shape[1]) * sample_time, command.shape)
    none = np.empty((len(command), 0))
    found = []
    for name, values in {"times": times, **others}.items():
        if values is not None and not _fits(values.shape, command.shape, name in PARTED):
            parts = ", or columns for equal parts of each sample" if name in PARTED else ""
            raise UserError(f"{name} is {values.shape}, expected {command.shape}{parts}")
        found.append(none if values is None else np.require(values, np.float64, _PLAIN))
    if external is not None and load_inertia is not None and external.shape != load_inertia.shape:
        raise UserError(f"external is {external.shape} and load_inertia {load_inertia.shape}, expected one shape")
    if times is not None:
        found[0] = np.require(found[0] - found[0][:, :1], np.float64, _PLAIN)
        over = np.arange(1, found[0].shape[1]) >= lengths[:, None]
        if not (over | (found[0][:, 1:] > found[0][:, :-1])).all():
            raise UserError("times do not rise, expected seconds, each later than the one before")
    return tuple(found)


def _fits(shape: tuple[int, ...], samples: tuple[int, ...], parted: bool) -> bool:
    """Whether an input [E, T], or of equal parts of each sample, is one for a command of this shape."""
    if not parted or shape[:1] != samples[:1] or len(shape) != 2:
        return shape == samples
    return shape[1] >= samples[1] and shape[1] % max(samples[1], 1) == 0


@compiled
def episode_log(given: Prepared, e: int, substeps: int) -> JointLog:
    """An episode, in so many steps a sample; it points into what is given."""
    samples, times, scale = given.command.shape[1], given.times[e], given.scale[e]
    external, load_inertia = given.external[e], given.load_inertia[e]
    there = (len(scale) > 0, len(external) > 0, len(load_inertia) > 0)
    parts = max(len(external), len(load_inertia)) // samples if there[1] or there[2] else 1
    first, observed = (given.first[e, 0], given.first[e, 1]), pointer(given.observed[e])
    before = (given.lengths[e], pointer(given.command[e]), first, observed, given.leak, given.sample_time, substeps)
    return JointLog(*before, pointer(times), there, pointer(scale), parts, pointer(external), pointer(load_inertia))


def _compile(sources: str) -> Callable[..., Any]:
    """The kernel. `sources`, a digest of this room's code, is part of what numba's cache knows it by.

    numba would only notice a change of this very file, and go on with stale formulas of the others.
    """

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def kernel(given: Prepared, fewest: bool, share: int, shares: int, out: np.ndarray) -> None:
        sources  # noqa: B018
        episodes, tables = len(given.command), given.tables
        for job in range(share, len(given.machines) * episodes, shares):
            c, e = divmod(job, episodes)
            row = given.machines[c]
            machine = of_gains(machine_at(pointer(row)), given.gains[e])
            heights = row[_WIDTH:]
            states = out[c, e, : given.lengths[e]]
            one = machine.backlash_width == 0 and machine.compliance_stiffness == math.inf
            clocked = given.times.shape[1] > 0
            steps = 1 if fewest and one and not clocked and steady(machine, heights) else given.substeps
            log = episode_log(given, e, steps)
            if clocked and one:
                clocked_one_mass(machine, tables, heights, log, pointer(states))
            elif clocked:
                clocked_two_masses(machine, tables, heights, log, pointer(states))
            elif one:
                one_mass(machine, tables, heights, log, states)
            else:
                two_masses(machine, tables, heights, log, states)
            if machine.encoder_quantization_resolution > 0:
                resolution, offset = machine.encoder_quantization_resolution, machine.encoder_quantization_offset
                quantize(states, resolution, given.sample_time, given.times[e], offset)

    return kernel


def digest(*others: Path) -> str:
    """Of all the code in this room, of effects of other packages, and of other files."""
    room = set(Path(__file__).parent.rglob("*.py"))
    foreign = {Path(inspect.getfile(type(effect))) for effect in JOINT_EFFECTS} - room
    digest = hashlib.sha256()
    for path in [*sorted(room), *sorted(foreign), *others]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


_kernel = _compile(digest())
