"""Simulate many machines over many episodes: compiled, in parallel, the same bits whatever the number of threads."""

import hashlib
import math
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from vision_s2r.errors import UserError
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.drive import (
    Glide,
    commanded,
    glide,
    needs_velocity,
    on_load,
    on_motor,
    steady,
    viscous,
    weight_at,
)
from vision_s2r.joint.effects.compliance import spring_response
from vision_s2r.joint.effects.encoder_quantization import quantise
from vision_s2r.joint.effects.inertia import half
from vision_s2r.joint.effects.latency import split_delay
from vision_s2r.joint.machine import COLUMNS, Machine
from vision_s2r.joint.one_mass import one_mass_step
from vision_s2r.joint.tables import Tables
from vision_s2r.joint.two_masses import play_step, spring_step

STEP = 0.002  # s; the default step is the longest below it that divides the sample time
WORTH_THREADS = 2_000_000  # steps; less than this is over before threads have started

_WIDTH = len(COLUMNS)
_NO_TABLES = Tables()


def simulate(
    machines: np.ndarray,
    command: np.ndarray,
    first: np.ndarray,
    sample_time: float,
    *,
    lengths: np.ndarray | None = None,
    observed: np.ndarray | None = None,
    leak: float = 0.0,
    substeps: int | None = None,
    tables: Tables | None = None,
    threads: int | None = None,
) -> np.ndarray:
    """Positions and velocities [C, E, T, 2] float64 (rad, rad/s, or m, m/s) that the encoder shows.

    machines [C, P]   rows of `pack`; with `tables` the heights of their knots behind, [C, P + tables.width]
    command [E, T]    current (A), or torque or force where the torque constant is 1; held between samples
    first [E, 2]      position and velocity at the first sample
    sample_time       s between samples
    lengths [E]       samples of each episode, T by default; rows beyond are NaN
    observed [E, T, 2], leak    an observer: at each sample `leak` times (observed - simulated) is added to the
                      simulated state, after its row is written, so that the row is a prediction. Where observed is
                      NaN nothing is added. leak = 0 simulates freely.
    substeps          integration steps a sample; by default as many as keep them at 2 ms or less, and one where
                      that is exact: no torque varies between samples, and no play or spring divides the joint
    threads           by default as many as the machine has, for work that is worth it

    Row k is the state at sample k, before command k acts. Play starts in its middle, a spring untwisted; latency
    begins with no command (0). Raises UserError for shapes that do not fit.
    """
    layout = (tables or _NO_TABLES).array()
    machines, command, first = (np.ascontiguousarray(x, dtype=np.float64) for x in (machines, command, first))
    episodes, samples = _check(machines, command, first, sample_time, (tables or _NO_TABLES).width)
    lengths = np.full(episodes, samples) if lengths is None else np.ascontiguousarray(lengths, dtype=np.int64)
    if lengths.shape != (episodes,) or (episodes and not 0 <= lengths.min() <= lengths.max() <= samples):
        raise UserError(f"lengths {lengths}: expected {episodes} numbers from 0 to {samples}")
    if observed is None or leak == 0:
        observed, leak = np.empty((episodes, 0, 2)), 0.0
    elif observed.shape != (episodes, samples, 2):
        raise UserError(f"observed is {observed.shape}, expected {(episodes, samples, 2)}")
    observed = np.ascontiguousarray(observed, dtype=np.float64)
    if substeps is not None and substeps < 1:
        raise UserError(f"substeps is {substeps}, expected 1 or more")
    steps = substeps or max(1, math.ceil(sample_time / STEP - 1e-9))
    out = np.full((len(machines), episodes, samples, 2), np.nan)
    jobs = len(machines) * episodes
    if threads is None:
        threads = len(os.sched_getaffinity(0)) if jobs * samples * steps >= WORTH_THREADS else 1
    threads = max(1, min(threads, jobs))

    inputs = (command, first, float(sample_time), lengths, observed, float(leak))

    def share(k: int) -> None:
        _kernel(machines, *inputs, steps, substeps is None, layout, k, threads, out)

    if threads == 1:
        share(0)
    else:
        # Threads of our own rather than numba's: its default layer must not be entered from two threads at once.
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(share, range(threads)))
    return out


def _check(
    machines: np.ndarray, command: np.ndarray, first: np.ndarray, sample_time: float, heights: int
) -> tuple[int, int]:
    if machines.ndim != 2 or machines.shape[1] != _WIDTH + heights:
        raise UserError(f"machines are {machines.shape}, expected [C, {_WIDTH + heights}]")
    if command.ndim != 2 or first.shape != (len(command), 2):
        raise UserError(f"command is {command.shape} and first {first.shape}, expected [E, T] and [E, 2]")
    if not 0 < sample_time < math.inf:
        raise UserError(f"sample_time is {sample_time}, expected seconds, more than 0")
    return command.shape[0], command.shape[1]


@compiled
def _one_mass(
    machine: Machine,
    tables: np.ndarray,
    heights: np.ndarray,
    command: np.ndarray,
    first: np.ndarray,
    sample_time: float,
    observed: np.ndarray,
    leak: float,
    substeps: int,
    out: np.ndarray,
) -> None:
    """An episode of a joint without play or spring, into `out` [T, 2]."""
    whole, fraction = split_delay(machine.latency_delay, sample_time)
    position, velocity = first[0], first[1]
    weight = weight_at(machine, velocity)
    other = on_motor(machine, tables, heights, position, velocity, 0.0) + on_load(machine, position)
    fast = not needs_velocity(machine, tables)
    counts, steps = _segments(fraction, sample_time, substeps)
    glides = _glides(machine, 0.5 * sample_time, machine.inertia, steps)
    for k in range(len(out)):
        out[k, 0], out[k, 1] = position, velocity
        if leak > 0:
            position += _correction(leak, observed[k, 0], position)
            velocity += _correction(leak, observed[k, 1], velocity)
        time = k * sample_time
        if machine.thermal_drift_rate != 0:
            glides = _glides(machine, time + 0.5 * sample_time, machine.inertia, steps)
        for segment in range(2):
            sent = k - whole - 1 + segment
            current = command[sent] if sent >= 0 else 0.0
            step = steps[segment]
            ahead, back = glides[segment]
            for _ in range(counts[segment]):
                position, velocity, weight, other = one_mass_step(
                    machine,
                    tables,
                    heights,
                    position,
                    velocity,
                    weight,
                    other,
                    current,
                    time + 0.5 * step,
                    ahead,
                    back,
                    step,
                    fast,
                )
                time += step


@compiled
def _two_masses(
    machine: Machine,
    tables: np.ndarray,
    heights: np.ndarray,
    command: np.ndarray,
    first: np.ndarray,
    sample_time: float,
    observed: np.ndarray,
    leak: float,
    substeps: int,
    out: np.ndarray,
) -> None:
    """An episode of a joint with play or a spring, into `out` [T, 2]."""
    whole, fraction = split_delay(machine.latency_delay, sample_time)
    inertia = half(machine.inertia)
    sprung = machine.compliance_stiffness < math.inf
    state = (first[1], first[1], 0.0, first[0], 0.0)
    weight = weight_at(machine, first[1])
    on_shaft = on_motor(machine, tables, heights, first[0], first[1], 0.0)
    fast = not needs_velocity(machine, tables)
    engaged, free = np.empty((2, 4, 5)), np.empty((2, 4, 5))
    believed = machine.viscous_damping
    counts, steps = _segments(fraction, sample_time, substeps)
    for segment in range(2):
        if sprung:
            stiffness, spring_damping = machine.compliance_stiffness, machine.compliance_damping
            spring_response(stiffness, spring_damping, believed, inertia, steps[segment], engaged[segment])
            spring_response(0.0, 0.0, believed, inertia, steps[segment], free[segment])
    for k in range(len(out)):
        v_motor, v_load, twist, position, side = state
        out[k, 0], out[k, 1] = position, v_load
        if leak > 0:
            position += _correction(leak, observed[k, 0], position)
            correction = _correction(leak, observed[k, 1], v_load)
            state = (v_motor + correction, v_load + correction, twist, position, side)
        time = k * sample_time
        if k == 0 or machine.thermal_drift_rate != 0:
            damping = (
                viscous(machine, 1.0, time + 0.5 * sample_time),
                viscous(machine, -1.0, time + 0.5 * sample_time),
            )
            joined = _glides(machine, time + 0.5 * sample_time, machine.inertia, steps)
            alone = _glides(machine, time + 0.5 * sample_time, inertia, steps)
        for segment in range(2):
            sent = k - whole - 1 + segment
            current = command[sent] if sent >= 0 else 0.0
            step = steps[segment]
            for _ in range(counts[segment]):
                v_motor, v_load, twist, position, side = state
                middle = v_motor
                if not fast:
                    motor = commanded(machine, current, v_motor)
                    if sprung:
                        ahead = spring_step(
                            machine,
                            state,
                            weight,
                            motor,
                            motor + on_shaft,
                            on_load(machine, position),
                            damping,
                            believed,
                            engaged[segment],
                            free[segment],
                            step,
                        )[0]
                    else:
                        ahead = play_step(
                            machine,
                            state,
                            weight,
                            motor,
                            motor + on_shaft,
                            on_load(machine, position),
                            joined[segment],
                            alone[segment],
                            step,
                        )[0]
                    middle = 0.5 * (v_motor + ahead)
                    weight = weight_at(machine, middle)
                motor = commanded(machine, current, middle)
                halfway = position + 0.5 * step * v_load
                shaft = position + twist + 0.5 * step * middle
                on_shaft = on_motor(machine, tables, heights, shaft, middle, time + 0.5 * step)
                load = on_load(machine, halfway)
                if sprung:
                    state = spring_step(
                        machine,
                        state,
                        weight,
                        motor,
                        motor + on_shaft,
                        load,
                        damping,
                        believed,
                        engaged[segment],
                        free[segment],
                        step,
                    )
                else:
                    state = play_step(
                        machine,
                        state,
                        weight,
                        motor,
                        motor + on_shaft,
                        load,
                        joined[segment],
                        alone[segment],
                        step,
                    )
                time += step


@compiled
def _segments(fraction: float, sample_time: float, substeps: int) -> tuple[tuple[int, int], tuple[float, float]]:
    """Steps, and their length, before and after the command changes within a sample."""
    rest = sample_time - fraction
    before = math.ceil(substeps * fraction / sample_time)
    after = max(math.ceil(substeps * rest / sample_time - 1e-9), 1)
    return (before, after), (fraction / max(before, 1), rest / after)


@compiled
def _glides(
    machine: Machine, time: float, inertia: float, steps: tuple[float, float]
) -> tuple[tuple[Glide, Glide], tuple[Glide, Glide]]:
    """What viscous damping at this time makes of motion ahead and back, in the steps of both segments."""
    ahead, back = viscous(machine, 1.0, time), viscous(machine, -1.0, time)
    return (
        (glide(ahead, inertia, steps[0]), glide(back, inertia, steps[0])),
        (glide(ahead, inertia, steps[1]), glide(back, inertia, steps[1])),
    )


@compiled
def _correction(leak: float, observed: float, simulated: float) -> float:
    return 0.0 if math.isnan(observed) else leak * (observed - simulated)


def _compile(sources: str) -> Callable[..., Any]:
    """The kernel. `sources`, a digest of this room's code, is part of what numba's cache knows it by.

    numba would only notice a change of this very file, and go on with stale formulas of the others.
    """

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def kernel(
        machines: np.ndarray,
        command: np.ndarray,
        first: np.ndarray,
        sample_time: float,
        lengths: np.ndarray,
        observed: np.ndarray,
        leak: float,
        substeps: int,
        fewest: bool,
        tables: np.ndarray,
        share: int,
        shares: int,
        out: np.ndarray,
    ) -> None:
        sources  # noqa: B018
        episodes = command.shape[0]
        for job in range(share, machines.shape[0] * episodes, shares):
            c, e = divmod(job, episodes)
            row, length = machines[c], lengths[e]
            machine = Machine(*to_fixed_tuple(row, _WIDTH))  # type: ignore[call-arg]
            heights = row[_WIDTH:]
            states = out[c, e, :length]
            if machine.backlash_width > 0 or machine.compliance_stiffness < math.inf:
                _two_masses(
                    machine, tables, heights, command[e], first[e], sample_time, observed[e], leak, substeps, states
                )
            else:
                steps = 1 if fewest and steady(machine, heights) else substeps
                _one_mass(machine, tables, heights, command[e], first[e], sample_time, observed[e], leak, steps, states)
            if machine.encoder_quantization_resolution > 0:
                quantise(states, machine.encoder_quantization_resolution, sample_time)

    return kernel


def _digest() -> str:
    folder = Path(__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


_kernel = _compile(_digest())
