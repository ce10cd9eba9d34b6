"""Diagnosis beside MuJoCo's own system identification: the same arm and log; that one is told what is wrong, by name.

`mujoco.sysid` (Gauss-Newton on free runs, by finite differences) is given the parameters that differ, their nominal
values to start from, and bounds; the diagnosis is given the log and has to find the names.
"""

import contextlib
import importlib
import io
import math
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from vision_s2r.arm.effect import PAYLOAD
from vision_s2r.arm.model import CARRIED, opened
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.errors import UserError
from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.gapbench.generate import arm, arm_bodies
from vision_s2r.gapbench.generate.arm_bullet import Real
from vision_s2r.gapbench.score.score import label
from vision_s2r.patch.arm import mjcf
from vision_s2r.progress import tracked
from vision_s2r.recording import ArmRecording, read
from vision_s2r.results import publish

ARM = "xarm6"
LOG = arm.ArmLog(rate=100.0, episodes=4, seconds=15.0)
STEP = 1e-3  # s, of MuJoCo
JOBS = 2
# What MuJoCo's models have an attribute for, and the joint that it is of.
WRONG = {"viscous_damping": 2, PAYLOAD: None}
FARTHEST, HEAVIEST = 0.5, 5.0  # m, kg: bounds of a payload
Values = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class _Taken:
    """What one way found, and what it took."""

    error: float  # the largest of its parameters', relative; nan where a name is missing
    seconds: float  # by the clock
    work: float  # s of all cores

    @property
    def cells(self) -> list[float | str]:
        """As a table has them."""
        return ["–" if math.isnan(self.error) else 1e2 * self.error, self.seconds, self.work]


def run(seed: int, out: Path) -> Path:
    """Both ways on one arm after the other; prints and writes sysid.json, whose path it returns.

    Raises UserError where mujoco.sysid is not installed.
    """
    sysid = _sysid()
    rows = []
    for k, name in enumerate(tracked(WRONG, len(WRONG), "arms")):
        with tempfile.TemporaryDirectory() as folder:
            truth = _record(name, np.random.default_rng([seed, k]), Path(folder))
            recording = read(Path(folder))
            assert isinstance(recording, ArmRecording)
            FreeRuns(recording).run({}, 0, rows=2)  # compiles, as the next line does
            free_run(next(iter(recording.joints.values())), {})
            named, ours = _diagnosed(recording, truth)
            theirs = _identified(sysid, recording, truth)
        rows.append([", ".join(truth), ", ".join(named) or "nothing", *ours.cells, *theirs.cells])
    measured = ("error, %", "s", "s of all cores")
    columns = [
        "wrong",
        "names found",
        *(f"{way}: {each}" for way in ("diagnosis", "mujoco.sysid, told the names") for each in measured),
    ]
    return publish(out / "sysid.json", f"vision-s2r benchmark sysid seed={seed}", columns, rows)


def _sysid() -> Any:
    sysid = importlib.import_module("mujoco.sysid")
    if not hasattr(sysid, "optimize"):  # it imports as an empty module without what it needs
        raise UserError("benchmark sysid needs pip install 'vision-s2r[sysid]'")
    return sysid


def _record(name: str, rng: np.random.Generator, folder: Path) -> Values:
    """Write the recording of an arm that has this effect; returns what is true."""
    bodies = arm_bodies.shipped(ARM)
    believed = arm.believed(bodies, rng)
    real, servos = Real(bodies), list(believed)
    joint = WRONG[name]
    if joint is None:
        real = Real(bodies, arm.drawn_payload(bodies, rng))
        assert real.payload is not None
        truth = {name: dict(zip(("mass", "x", "y", "z"), real.payload, strict=True))}
    else:
        servos[joint], parameters = arm.with_effect(name, believed[joint], rng)
        truth = {f"{bodies.joints[joint]}.{name}": parameters}
    arm.write(folder, bodies, believed, LOG, arm.logged(real, servos, LOG, rng))
    return truth


def _clocked(work: Callable[[], Any]) -> tuple[Any, float, float]:
    begin = time.perf_counter(), time.process_time()
    found = work()
    return found, time.perf_counter() - begin[0], time.process_time() - begin[1]


def _error(truth: Values, found: Values) -> float:
    """The largest relative error; lengths are relative to the longest of them."""
    errors = []
    for name, values in truth.items():
        if name not in found:
            return float("nan")
        for key, value in values.items():
            beside = [values[other] for other in "xyz"] if key in "xyz" else [value]
            errors.append(abs(found[name][key] - value) / max(map(abs, beside)))
    return max(errors)


def _diagnosed(recording: ArmRecording, truth: Values) -> tuple[list[str], _Taken]:
    done, seconds, work = _clocked(lambda: diagnose(recording, jobs=JOBS).to_dict())
    found = {
        label(effect): {key: one["value"] for key, one in effect["parameters"].items()} for effect in done["effects"]
    }
    return list(found), _Taken(_error(truth, found), seconds, work)


# By mujoco.sysid


def _identified(sysid: Any, recording: ArmRecording, truth: Values) -> _Taken:
    spec = _spec(recording, PAYLOAD in truth)
    names = list(recording.joints)
    parameters = sysid.ParameterDict()
    for name, values in truth.items():
        for key in values:
            parameters.add(_parameter(sysid, recording, name, key))
    model = spec.compile()
    data, states, controls, sensors = mujoco.MjData(model), [], [], []
    joints = list(recording.joints.values())
    for k, length in enumerate(recording.any.lengths):
        data.qpos[:] = [joint.position[k, 0] for joint in joints]
        states.append(sysid.create_initial_state(model, data.qpos, data.qvel, data.act))
        held = round(recording.any.sample_time / STEP)
        command = np.repeat(np.array([joint.command[k, :length] for joint in joints]).T, held, axis=0)
        controls.append(sysid.TimeSeries(np.arange(len(command)) * STEP, command))
        measured = np.array([joint.position[k, :length] for joint in joints]).T
        times = np.arange(length) * recording.any.sample_time
        sensors.append(sysid.TimeSeries.from_names(times, measured, model, [f"{name}_pos" for name in names]))
    episodes = [str(k) for k in recording.episodes]
    sequences = sysid.ModelSequences("arm", spec, episodes, states, controls, sensors)
    residual = sysid.build_residual_fn(models_sequences=[sequences])
    with contextlib.redirect_stdout(io.StringIO()):  # it prints every iteration
        (found, _), seconds, work = _clocked(
            lambda: sysid.optimize(initial_params=parameters, residual_fn=residual, verbose=False)
        )
    identified = {name: {key: float(found[f"{name}.{key}"].value[0]) for key in truth[name]} for name in truth}
    return _Taken(_error(truth, identified), seconds, work)


def _spec(recording: ArmRecording, carries: bool) -> mujoco.MjSpec:
    """The simulator as it came, its servos as actuators, sensors of all joints, and a body for a payload."""
    spec = mujoco.MjSpec.from_string(mjcf({}, recording))
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for name in recording.joints:
        spec.joint(name).limited = False
        spec.add_sensor(
            name=f"{name}_pos", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name
        )
    if carries:
        last = opened(recording.model).body_of(recording.tip, list(recording.joints))
        body = spec.body(last).add_body(name=CARRIED, mass=1e-3, inertia=[1e-9] * 3, explicitinertial=True)
        body.ipos = [0.0, 0.0, 0.0]
    return spec


def _parameter(sysid: Any, recording: ArmRecording, name: str, key: str) -> Any:
    """A parameter of the truth: where it starts, its bounds, and what it is in the model."""
    joint, _, effect = name.rpartition(".")

    def set_to(spec: mujoco.MjSpec, given: Any) -> None:
        value = float(given.value[0])
        if effect == "viscous_damping":
            spec.joint(joint).damping = [value, 0.0, 0.0]
        elif effect == "coulomb_friction":
            spec.joint(joint).frictionloss = value
        elif effect == "torque_saturation":
            spec.actuator(joint).forcerange = [-value, value]
        elif effect == "proportional_gain":
            spec.actuator(joint).gainprm[0], spec.actuator(joint).biasprm[1] = value, -value
        elif key == "mass":
            spec.body(CARRIED).mass = value
        else:
            spec.body(CARRIED).pos["xyz".index(key)] = value

    if effect == PAYLOAD:
        start, low, high = (0.1, 1e-3, HEAVIEST) if key == "mass" else (0.0, -FARTHEST, FARTHEST)
    else:
        nominal = recording.joints[joint].nominal
        start = nominal["command_limit" if effect == "torque_saturation" else effect]
        low, high = 0.1 * start, 10 * start
    return sysid.Parameter(f"{name}.{key}", start, low, high, modifier=set_to)
