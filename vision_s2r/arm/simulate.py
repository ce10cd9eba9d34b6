"""A free run of a whole arm."""

import math
from dataclasses import dataclass

import numpy as np

from vision_s2r.arm import sweep
from vision_s2r.arm.bodies import Bodies
from vision_s2r.joint import COLUMNS
from vision_s2r.joint.tables import Tables

STEP, SHORTEST = 0.002, 0.00025  # s
SWING = 0.25  # rad of a servo's oscillation in a step

_INERTIA, _GAIN = COLUMNS.index("inertia"), COLUMNS.index("proportional_gain")


@dataclass(frozen=True)
class ArmRun:
    """One episode of an arm."""

    states: np.ndarray  # [J, T, 2] positions and velocities (rad, rad/s, or m, m/s) that the encoders show
    # [T·S, J] mean torque (N·m, N) that the rest of the arm put on a joint, in S equal parts of the time from each row
    # to the next, a step or so long each: where a command steps, it changes within a row
    load: np.ndarray


def simulate(
    bodies: Bodies,
    machines: np.ndarray,
    command: np.ndarray,
    first: np.ndarray,
    times: np.ndarray,
    parts: int | None = None,
    rows: int | None = None,
) -> ArmRun:
    """Run all joints of an arm over one episode.

    machines [J, P]   rows of `vision_s2r.joint.pack`, whose inertia is the rotor's
    command [J, T]    as each machine takes it; held between rows
    first [J, 2]      positions and velocities at the first row
    times [T]         s of each row, rising
    parts             steps of the integrator in the usual time between rows; by default as `parts_of` has them
    rows              how many to run, from the first; by default all

    Bodies are evaluated in the middle of each step.
    """
    machines, command, first = (np.require(x, np.float64, ("C", "W")) for x in (machines, command, first))
    times = np.require(times - times[0], np.float64, ("C", "W"))
    joints, samples = len(command), rows or len(times)
    sample_time = float(np.median(np.diff(times)))
    parts = parts or parts_of(bodies, machines, first, times)
    step = sample_time / parts
    tables = Tables().array()
    states = np.zeros((joints, sweep.STATE))
    sweep.start(machines, tables, first, states)
    out = np.full((joints, samples, 2), np.nan)
    out[:, 0] = first
    load, steps = np.zeros((samples * parts, joints)), np.zeros(samples * parts)
    room = np.empty(sweep.ROOM * joints + joints**2)
    sweep.run(bodies.rigid, machines, command, times, first, states, tables, step, parts, out, load, steps, room)
    sweep.show(machines, sample_time, times[:samples], out)
    return ArmRun(out, _filled(load, steps))


def parts_of(bodies: Bodies, machines: np.ndarray, first: np.ndarray, times: np.ndarray) -> int:
    """Steps between two rows, of 2 ms or less, in which no servo or spring swings far; arguments as of `simulate`."""
    inertia = machines[:, _INERTIA] + np.diagonal(bodies.terms(first[:, 0], first[:, 1])[0])
    fastest = float(np.sqrt((np.nan_to_num(machines[:, _GAIN]) + bodies.rigid.stiffness) / inertia).max())
    longest = STEP if fastest == 0 else float(np.clip(SWING / fastest, SHORTEST, STEP))
    return max(math.ceil(float(np.median(np.diff(times))) / longest - 1e-9), 1)


def _filled(load: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Means; where no step began in a part, those before."""
    last = np.maximum.accumulate(np.where(steps > 0, np.arange(len(steps)), 0))
    return (load / np.maximum(steps, 1)[:, None])[last]
