"""Many joints stepped together, a sample at a time: what a controller that looks and then commands needs."""

import copy
import math
import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.joint.drive import counted, glides, held, needs_velocity, steady
from vision_s2r.joint.effects.latency import split_delay
from vision_s2r.joint.log import segments
from vision_s2r.joint.machine import COLUMNS, check, machine_at
from vision_s2r.joint.one_mass import one_mass_sample, one_mass_start
from vision_s2r.joint.pointer import pointer, shifted
from vision_s2r.joint.simulation import STEP, digest
from vision_s2r.joint.tables import Tables
from vision_s2r.joint.two_masses import (
    RESPONSES,
    sprung,
    two_masses_paths,
    two_masses_responses,
    two_masses_sample,
    two_masses_start,
)

WORTH_THREADS = 4096  # joints; less than this is over before a second thread has woken

_WIDTH = len(COLUMNS)
_DELAY = COLUMNS.index("latency.delay")
_STIFFNESS = COLUMNS.index("compliance.stiffness")
_SERVO = COLUMNS.index("proportional_gain")
_STATE = 8  # position and velocity of the load, weights, other torque, velocity of the motor, twist, side
_MOVING = np.array([0, 1, 5, 6])  # of these, positions and velocities
_NUDGE = np.array([1e-5, 1e-4, 1e-4, 1e-5, 4e-4, 4e-4])  # of each of them, and of two commands: rad, rad/s, A


class Joints:
    """N joints, each a machine of its own with its own clock.

    `step(command)` holds a command [N] for a sample and returns what the encoders show then; `reset` gives some of
    them new machines and states. Under the same commands the states are those of `simulate`, to rounding. An
    encoder that counts shows the difference of its last two positions as velocity, since a controller cannot look
    ahead as a log's central difference does.

    machines [N, P]   rows of `pack`
    sample_time       s between commands: one for all, or one a joint [N]
    first [N, 2]      position and velocity to begin with, 0 by default

    Raises UserError for shapes that do not fit, and machines that cannot be.
    """

    def __init__(
        self,
        machines: np.ndarray,
        sample_time: float | np.ndarray,
        first: np.ndarray | None = None,
    ) -> None:
        count = len(machines)
        self._sample_time = np.empty(count)
        self._substeps = np.empty(count, np.int64)
        self._layout = Tables().array()
        self._machines = np.zeros((count, _WIDTH))
        self._states = np.zeros((count, _STATE))
        self._samples = np.zeros(count, np.int64)  # since each was reset
        self._sent = np.zeros((count, 0))  # a ring of the last commands, as long as the longest latency
        self._responses = np.zeros((1, *RESPONSES))  # one a joint, once one of them has a spring
        self._shown = np.zeros((count, 2))
        threads = len(os.sched_getaffinity(0)) if count >= WORTH_THREADS else 1
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self._threads = threads
        self.reset(np.arange(count), machines, np.zeros((count, 2)) if first is None else first, sample_time)

    def __len__(self) -> int:
        return len(self._machines)

    @property
    def shown(self) -> np.ndarray:
        """Position and velocity [N, 2] that the encoders show now."""
        return self._shown.copy()

    @property
    def true(self) -> np.ndarray:
        """Position and velocity [N, 2] of the loads, whatever the encoders show."""
        return self._states[:, :2].copy()

    def take(self, which: np.ndarray) -> "Joints":
        """Copies of the joints `which` [K] as they are now, to be stepped on their own; one may be taken often."""
        copies = copy.copy(self)
        for name in ("_machines", "_sample_time", "_substeps", "_samples", "_sent", "_states", "_shown"):
            setattr(copies, name, getattr(self, name)[which])
        if len(self._responses) == len(self):
            copies._responses = self._responses[which]
        return copies

    def placed(self, machines: np.ndarray, moving: np.ndarray) -> "Joints":
        """As many joints `machines` [N, P] with these clocks at this time, in states [N, 4] as `moving` has them.

        Nothing is on its way to them, and where there is twist their play is closed.
        """
        placed, every = self.take(np.arange(len(self))), np.arange(len(self))
        placed.reset(every, machines, moving[:, :2])
        placed._samples = self._samples.copy()
        placed._states[:, _MOVING] = moving
        placed._states[:, -1] = np.sign(moving[:, -1])
        return placed

    def reset(
        self,
        which: np.ndarray,
        machines: np.ndarray,
        first: np.ndarray,
        sample_time: float | np.ndarray | None = None,
    ) -> None:
        """Joints `which` [K] become `machines` [K, P] that have done nothing yet, in state `first` [K, 2].

        `sample_time` [K], or one for all of them, changes theirs.
        """
        if machines.shape != (len(which), _WIDTH) or first.shape != (len(which), 2):
            shapes = f"{(len(which), _WIDTH)} and {(len(which), 2)}"
            raise UserError(f"machines are {machines.shape} and states {first.shape}, expected {shapes}")
        check(machines)
        if not np.isnan(machines[:, _SERVO]).all():
            raise UserError("position servos run over whole logs, in `simulate`; Joints are commanded by currents")
        if sample_time is not None:
            seconds = np.broadcast_to(sample_time, which.shape)
            if not (np.all(seconds > 0) and np.all(np.isfinite(seconds))):
                raise UserError(f"sample_time is {sample_time}, expected seconds, more than 0")
            self._sample_time[which] = seconds
            self._substeps[which] = np.maximum(np.ceil(seconds / STEP - 1e-9), 1)
        if len(self._responses) < len(self) and (machines[:, _STIFFNESS] < math.inf).any():
            self._responses = np.zeros((len(self), *RESPONSES))
        self._machines[which] = machines
        self._remember(int((machines[:, _DELAY] / self._sample_time[which]).max(initial=0.0)) + 2)
        self._samples[which] = 0
        self._sent[which] = 0.0
        self._states[which, :2] = first
        _start(
            self._machines,
            np.require(which, np.int64),
            self._layout,
            self._sample_time,
            self._substeps,
            self._states,
            self._responses,
            self._shown,
        )

    def _remember(self, commands: int) -> None:
        """Make the ring at least so long; the joints that go on keep theirs."""
        before = self._sent.shape[1]
        if commands <= before:
            return
        ring = np.zeros((len(self), commands))
        joint, back = np.indices((len(self), before))
        sample = self._samples[:, None] - 1 - back
        known = sample >= 0
        ring[joint[known], sample[known] % commands] = self._sent[joint[known], sample[known] % before]
        self._sent = ring

    def step(self, command: np.ndarray) -> np.ndarray:
        """Hold `command` [N] (A, or N·m) for a sample; positions and velocities [N, 2] that the encoders show then."""
        if command.shape != (len(self),):
            raise UserError(f"command is {command.shape}, expected {(len(self),)}")
        command = np.require(command, np.float64, "C")

        def share(k: int) -> None:
            _advance(
                self._machines, self._samples, self._sent, command, self._layout, self._sample_time, self._substeps,
                self._states, self._responses, self._shown, k, self._threads,
            )  # fmt: skip

        if self._pool is None:
            share(0)
        else:
            list(self._pool.map(share, range(self._threads)))
        return self._shown.copy()

    @property
    def machines(self) -> np.ndarray:
        """Their machines [N, P], rows of `pack`."""
        return self._machines.copy()

    @property
    def sample_time(self) -> np.ndarray:
        """Seconds [N] between commands."""
        return self._sample_time.copy()

    @property
    def moving(self) -> np.ndarray:
        """Position and velocity of the load, velocity of the motor, twist of play or spring [N, 4]."""
        return self._states[:, _MOVING]

    @property
    def delays(self) -> np.ndarray:
        """Whole samples [N] that a command waits; in what a latency has over it acts the one before."""
        return (self._machines[:, _DELAY] / self._sample_time).astype(int)

    def differentiated(self, command: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where `step(command)` would lead, [N, 4] as `moving`, and its Jacobian [N, 6, 4] by forward differences.

        Rows of the Jacobian are of small changes: of `moving` before, then of the command that begins to act within
        the sample (`delays` samples old) and of the one before that.
        """
        count, changes = len(self), len(_NUDGE)
        changed = self.take(np.tile(np.arange(count), changes + 1))  # and once unchanged, as the last
        sent = np.tile(command, changes + 1)
        joints, late, ring = np.arange(count), self.delays, self._sent.shape[1]
        for row, column in enumerate(_MOVING):
            changed._states[row * count + joints, column] += _NUDGE[row]
        now, before = count * (changes - 2), count * (changes - 1)
        changed._sent[now + joints, (self._samples - late) % ring] += _NUDGE[-2]
        changed._sent[before + joints, (self._samples - late - 1) % ring] += _NUDGE[-1]
        sent[now : now + count][late == 0] += _NUDGE[-2]
        changed.step(sent)
        after = changed.moving.reshape(changes + 1, count, -1)
        return after[-1], ((after[:-1] - after[-1]) / _NUDGE[:, None, None]).transpose(1, 0, 2)


def _compile(sources: str) -> tuple[Any, Any]:
    """The kernels; `sources` is part of what numba's cache knows them by."""

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def start(
        machines: np.ndarray,
        which: np.ndarray,
        layout: np.ndarray,
        sample_times: np.ndarray,
        substeps: np.ndarray,
        states: np.ndarray,
        responses: np.ndarray,
        shown: np.ndarray,
    ) -> None:
        sources  # noqa: B018
        none = np.empty(0)
        for n in which:
            machine = machine_at(shifted(pointer(machines), n * _WIDTH))
            position, velocity = states[n, 0], states[n, 1]
            if machine.backlash_width == 0 and not sprung(machine):
                _, _, weight, other = one_mass_start(machine, layout, none, position, velocity)
            else:
                _, weight, other = two_masses_start(machine, layout, none, position, velocity)
            if sprung(machine):
                _, fraction = split_delay(machine.latency_delay, sample_times[n])
                steps = segments(fraction, sample_times[n], substeps[n])[1]
                two_masses_responses(machine, steps, responses[n])
            states[n, 2], states[n, 3], states[n, 4] = weight[0], weight[1], other
            states[n, 5], states[n, 6], states[n, 7] = velocity, 0.0, 0.0
            shown[n, 0], shown[n, 1] = counted(machine, position), velocity

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def advance(
        machines: np.ndarray,
        samples: np.ndarray,
        sent: np.ndarray,
        command: np.ndarray,
        layout: np.ndarray,
        sample_times: np.ndarray,
        substeps: np.ndarray,
        states: np.ndarray,
        responses: np.ndarray,
        shown: np.ndarray,
        share: int,
        shares: int,
    ) -> None:
        sources  # noqa: B018
        none = np.empty(0)
        ring = sent.shape[1]
        count = len(machines)
        for n in range(share * count // shares, (share + 1) * count // shares):
            machine = machine_at(shifted(pointer(machines), n * _WIDTH))
            k, sample_time = samples[n], sample_times[n]
            sent[n, k % ring] = command[n]
            whole, fraction = split_delay(machine.latency_delay, sample_time)
            before = sent[n, (k - whole - 1) % ring] if k > whole else 0.0
            now = sent[n, (k - whole) % ring] if k >= whole else 0.0
            given = (held(before), held(now))
            time = k * sample_time
            fast = not needs_velocity(machine, layout)
            state = states[n]
            if machine.backlash_width == 0 and not sprung(machine):
                counts, steps = segments(fraction, sample_time, 1 if steady(machine, none) else substeps[n])
                paths = glides(machine, time + 0.5 * sample_time, machine.inertia, steps)
                one = (state[0], state[1], (state[2], state[3]), state[4])
                one = one_mass_sample(machine, layout, none, one, given, time, counts, steps, paths, fast)
                state[0], state[1], (state[2], state[3]), state[4] = one
            else:
                counts, steps = segments(fraction, sample_time, substeps[n])
                both = two_masses_paths(machine, time + 0.5 * sample_time, steps)
                masses = ((state[5], state[1], state[6], state[0], state[7]), (state[2], state[3]), state[4])
                response = responses[n if sprung(machine) else 0]
                masses = two_masses_sample(
                    machine, layout, none, masses, given, time, counts, steps, both, response, fast
                )
                (state[5], state[1], state[6], state[0], state[7]), (state[2], state[3]), state[4] = masses
            samples[n] = k + 1
            if machine.encoder_quantization_resolution > 0:
                position = counted(machine, state[0])
                shown[n, 1] = (position - shown[n, 0]) / sample_time
                shown[n, 0] = position
            else:
                shown[n, 0], shown[n, 1] = state[0], state[1]

    return start, advance


_start, _advance = _compile(digest())
