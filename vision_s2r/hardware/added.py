"""Effects added to logs of real drives: what the diagnosis makes of one that is known to be there.

A drive that moved as it did under u moves likewise under u + a, where something takes a away again: a friction, a mass,
a cogging more than it has. So a log whose command has a torque of the motion added to it is that of another drive, as
real as the first, of which one thing is known. Nothing here is shared with the simulator.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vision_s2r.fit.joint.slopes import episode_slopes
from vision_s2r.joint import JOINT_EFFECTS, unit
from vision_s2r.recording import JointRecording

SHARE = 0.1  # of the command's root mean square, that what is added has; of a mass or a gain that is believed
PERIODS = 8  # of a cogging, over the travel
STEPS = 5000  # of an encoder, over the travel
LATE = 8  # rows
RISING, OFTEN = 2.0, 0.1  # of friction at rest: times what else is added, below this part of the usual speed
NEAR_REST = 0.001  # of the usual speed, within which friction changes its direction
SMOOTHED = 0.01  # s to either side, that velocities are read off


@dataclass(frozen=True)
class Added:
    """A log with an effect of these `values` added to the drive that is believed in.

    The first of them is what is asked for, and `believed` what it would be without.
    """

    effect: str
    values: Mapping[str, float]
    believed: float
    recording: JointRecording

    @property
    def parameter(self) -> str:
        return next(iter(self.values))

    @property
    def size(self) -> float:
        """What is added."""
        return self.values[self.parameter] - self.believed


def with_effects(recording: JointRecording) -> Iterator[Added]:
    """A log of currents, torques or forces with each effect added, one at a time, that can be."""
    log, nominal = _Log.of(recording), recording.nominal
    for effect, (values, torque) in log.torques().items():
        believed = nominal.get("coulomb_friction" if "static" in values else effect, 0.0)
        yield Added(effect, values, believed, replace(recording, command=torque / nominal["torque_constant"]))
    step = log.travel / STEPS
    shown = np.round(recording.position / step) * step
    yield Added("encoder_quantization", {"resolution": step}, 0.0, replace(recording, position=shown, velocity=None))


@dataclass(frozen=True)
class _Log:
    """Torques, positions, velocities and accelerations [E, T], 0 beyond an episode's end."""

    recording: JointRecording
    u: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray

    @classmethod
    def of(cls, recording: JointRecording) -> "_Log":
        half = max(round(SMOOTHED / recording.sample_time), 1)
        velocity = episode_slopes(recording.position, recording.time, recording.lengths, half)
        acceleration = episode_slopes(velocity, recording.time, recording.lengths, half)
        q, v, a = (np.nan_to_num(each) for each in (recording.position, velocity, acceleration))
        return cls(recording, recording.nominal["torque_constant"] * recording.command, q, v, a)

    @property
    def travel(self) -> float:
        return float(np.nanmax(self.recording.position) - np.nanmin(self.recording.position))

    def torques(self) -> dict[str, tuple[dict[str, float], np.ndarray]]:
        """By effect: its values, and the torques [E, T] that a drive which has it would have been asked for."""
        u, v, time, had = self.u, self.v, self.recording.time, self.recording.nominal
        torque, speed = SHARE * _usual(u), _usual(v)
        direction, damping = np.tanh(v / (NEAR_REST * speed)), torque / speed
        teeth, rest = 2 * np.pi * PERIODS / self.travel, OFTEN * speed
        rising = 2 * damping / (had["viscous_damping"] * float(time.max())) if had["viscous_damping"] else 0.0
        late = np.concatenate([u[:, LATE:], np.repeat(u[:, -1:], LATE, axis=1)], axis=1)

        def more(name: str, size: float) -> dict[str, float]:
            return {"value": had[name] + size}

        drift = {"thermal_drift": ({"rate": rising}, u + had["viscous_damping"] * rising * time * v)}
        return {
            "viscous_damping": (more("viscous_damping", damping), u + damping * v),
            "coulomb_friction": (more("coulomb_friction", torque), u + torque * direction),
            "bias_torque": (more("bias_torque", torque), u + torque),
            "inertia": (more("inertia", SHARE * had["inertia"]), u + SHARE * had["inertia"] * self.a),
            "torque_constant": (more("torque_constant", SHARE * had["torque_constant"]), u / (1 + SHARE)),
            "asymmetric_friction": ({"viscous": damping, "coulomb": 0.0}, u + damping * np.abs(v)),
            "stribeck_friction": (
                {"static": had["coulomb_friction"] + RISING * torque, "velocity": rest},
                u + RISING * torque * np.exp(-((v / rest) ** 2)) * direction,
            ),
            "load_dependent_friction": ({"coefficient": SHARE}, u / (1 - SHARE * np.sign(u) * direction)),
            "cogging": ({"amplitude": torque, "teeth": teeth}, u - torque * np.sin(teeth * self.q)),
            "latency": ({"delay": LATE * self.recording.sample_time}, late),
        } | (drift if rising else {})


def _usual(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def measured(added: Added, report: Mapping[str, Any], without: Mapping[str, Any]) -> dict[str, Any]:
    """What the `report` of a log with an effect added says of it, beside that of the log `without`."""
    found, before = _found(report, added), _found(without, added)
    named = {each["name"]: each["share"] for each in report["effects"]}
    return {
        "effect": added.effect,
        "size": added.size,
        "unit": unit(JOINT_EFFECTS[added.effect].parameter(added.parameter), added.recording.units),
        "from": before["value"] if before else added.believed,
        "found": found,
        "share": named.get(added.effect),
        "others": sorted(named.keys() - {added.effect} - {each["name"] for each in without["effects"]}),
        "gap": report["gap"],
    }


def _found(report: Mapping[str, Any], added: Added) -> Mapping[str, Any] | None:
    """The parameter in a report, with its unit and interval: named, or refitted without a name."""
    for each in (*report["effects"], *report["refitted"]):
        if each["name"] == added.effect:
            parameter: Mapping[str, Any] = each["parameters"][added.parameter]
            return parameter
    return None
