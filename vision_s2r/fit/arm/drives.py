"""An arm's drives beside MuJoCo's bodies: what its models have no attribute for, a deadband or Stribeck's friction say.

Before each of MuJoCo's steps a drive gives its torque where the joint is, and says how much friction and damping the
joint has there; MuJoCo solves these with everything else that touches the arm.
"""

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numba
import numpy as np

from vision_s2r.arm import sweep
from vision_s2r.arm.sweep import log_of
from vision_s2r.errors import UserError
from vision_s2r.fit.arm.free_run import effects_of
from vision_s2r.fit.case import Values
from vision_s2r.joint import COLUMNS, NominalJoint, pack
from vision_s2r.joint.clock import inputs_of
from vision_s2r.joint.drive import commanded, dry, on_load, on_motor, viscous, weight_at
from vision_s2r.joint.machine import machine_at
from vision_s2r.joint.pointer import pointer, shifted
from vision_s2r.joint.simulation import digest
from vision_s2r.joint.tables import Tables
from vision_s2r.recording import ArmRecording

TWO_MASSES = ("backlash", "compliance")  # each divides a joint in two, of which MuJoCo's is one
KEPT = 64  # commands that are remembered at least

_DELAY = COLUMNS.index("latency.delay")


class ArmDrives:
    """The drives of a recording's joints, with the effects of a diagnosis.

    Call `act` before each `mujoco.mj_step` of the patched model, whose own actuators of these joints give nothing from
    then on. Steps of a millisecond or less follow a stiff servo.
    """

    def __init__(self, model: mujoco.MjModel, recording: ArmRecording, effects: Values) -> None:
        """`model` is that of patched.xml; `effects` are by JOINT.EFFECT, as `values(diagnosed(report))` has them.

        Raises UserError for a joint that the model lacks, and where play or a spring divides one in two.
        """
        names = list(recording.joints)
        for name in names:
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) < 0:
                raise UserError(f"the model has no joint '{name}', expected that of patched.xml")
            if divided := [each for each in effects_of(name, effects) if each in TWO_MASSES]:
                raise UserError(f"{name}: {divided[0]} divides a joint in two, of which MuJoCo's is one")
        joints = [model.joint(name) for name in names]
        self._model, self._timestep = model, float(model.opt.timestep)
        self._at, self._degree = (np.array([getattr(each, key)[0] for each in joints]) for key in ("qposadr", "dofadr"))
        of_joints = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
        own = of_joints & np.isin(model.actuator_trnid[:, 0], [each.id for each in joints])
        model.actuator_gainprm[own], model.actuator_biasprm[own] = 0.0, 0.0
        self._machines = np.array(
            [pack(NominalJoint(**each.nominal), effects_of(name, effects)) for name, each in recording.joints.items()]
        )
        self._room = KEPT + math.ceil(float(self._machines[:, _DELAY].max()) / self._timestep)
        self._begun = False

    def _begin(self, data: mujoco.MjData) -> None:
        joints = len(self._machines)
        self._first = np.stack([data.qpos[self._at], data.qvel[self._degree]], axis=1)
        self._start, self._count, self._begun = float(data.time), 0, True
        self._times, self._commands = np.zeros(2 * self._room), np.zeros((joints, 2 * self._room))
        self._acting = np.full(joints, -1)
        self._points = np.stack([self._first[:, 0], np.zeros(joints), np.full(joints, np.nan)], axis=1)

    def reset(self) -> None:
        """Whatever comes next is the first step: nothing was commanded yet."""
        self._begun = False

    def act(self, data: mujoco.MjData, command: np.ndarray) -> None:
        """Put on MuJoCo's joints what the drives make of commands [J], in the order of the recording, in a step."""
        if not self._begun:
            self._begin(data)
        time = float(data.time) - self._start
        self._remember(time, np.asarray(command, float))
        out = np.empty((len(self._machines), 3))
        _act(
            self._machines,
            self._commands,
            self._times[: self._count],
            self._first,
            self._acting,
            self._points,
            np.stack([data.qpos[self._at], data.qvel[self._degree]], axis=1),
            -data.qfrc_bias[self._degree],
            (time, self._timestep),
            Tables().array(),
            out,
        )
        data.qfrc_applied[self._degree] = out[:, 0]
        self._model.dof_frictionloss[self._degree], self._model.dof_damping[self._degree] = out[:, 1], out[:, 2]

    def _remember(self, time: float, command: np.ndarray) -> None:
        """One command more; of those that have acted the oldest are forgotten."""
        if self._count == len(self._times):
            gone = self._count - self._room
            self._times[: self._room], self._commands[:, : self._room] = self._times[gone:], self._commands[:, gone:]
            self._acting, self._count = self._acting - gone, self._room
        self._times[self._count], self._commands[:, self._count] = time, command
        self._count += 1


def _compile(sources: str) -> Callable[..., Any]:
    """The kernel; `sources` is part of what numba's cache knows it by."""

    @numba.njit(nogil=True, error_model="numpy", cache=True)
    def act(
        machines: np.ndarray,  # [J, P]
        commands: np.ndarray,  # [J, N]
        times: np.ndarray,  # [N] s
        first: np.ndarray,  # [J, 2] positions and velocities
        acting: np.ndarray,  # [J] rows of the commands that act
        points: np.ndarray,  # [J, 3] set points, their rates, and the errors that servos' derivatives have
        states: np.ndarray,  # [J, 2] positions and velocities now
        bodies: np.ndarray,  # [J] torques that weight and motion of the bodies put on the joints
        step: tuple[float, float],  # where it begins, and how long it is
        tables: np.ndarray,
        out: np.ndarray,  # [J, 3] torque, dry friction, viscous damping
    ) -> None:
        sources  # noqa: B018
        none = np.empty(0)
        for j in range(len(machines)):
            machine = machine_at(shifted(pointer(machines), j * machines.shape[1]))
            ends = (first[j, 0], first[j, 1])
            log = log_of(shifted(pointer(commands), j * commands.shape[1]), len(times), ends, step[1], pointer(times))
            position, velocity = states[j, 0], states[j, 1]
            cursor = (acting[j], 0, points[j, 0], points[j, 1], points[j, 2])
            given, cursor = inputs_of(machine, log, cursor, step[0], step[1], (position, velocity))
            acting[j], _, points[j, 0], points[j, 1], points[j, 2] = cursor
            motor = commanded(machine, tables, none, given, position, velocity, velocity)
            load = on_load(machine, position)
            other = on_motor(machine, tables, none, position, velocity, step[0]) + load
            forward = velocity > 0 or (velocity == 0 and motor + other > 0)
            direction = 1.0 if forward else -1.0
            out[j, 0] = motor + other
            out[j, 1] = dry(machine, direction, weight_at(machine, velocity), (motor, load + bodies[j]))
            out[j, 2] = viscous(machine, direction, step[0])

    return act


_act = _compile(digest(Path(inspect.getfile(sweep))))
