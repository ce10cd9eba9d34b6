"""Effects added to logs of real drives: what the diagnosis makes of one that is known to be there.

A drive that moved as it did under u moves likewise under u + a, where something takes a away again: a friction, a mass,
a cogging more than it has. So a log whose command has a torque of the motion added to it is that of another drive, as
real as the first, of which one thing is known. A position servo asks for that torque where its target is a / K_p
further. Nothing here is shared with the simulator.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vision_s2r.fit.joint.slopes import episode_slopes
from vision_s2r.joint import JOINT_EFFECTS, NominalJoint, unit
from vision_s2r.recording import JointRecording, Recording

# Of the usual torque, that what is added has, and of a mass or a gain that is believed. Of a servo's torques less is
# understood: its gains are the firmware's.
SHARE, OF_A_SERVO = 0.1, 0.3
PERIODS, A_ROW = 8, 1.0  # of a cogging, over the travel; and what may pass at the usual speed in a row, rad, at most
STEPS = 5000  # of an encoder, over the travel
LATE = 0.008  # s, in whole rows, one at least
RISING, OFTEN = 2.0, 0.1  # of friction at rest: times what else is added, below this part of the usual speed
NEAR_REST = 0.001  # of the usual speed, within which friction changes its direction
SMOOTHED, LEAST_ROWS = 0.01, 2  # s to either side, that velocities are read off; and rows at least


@dataclass(frozen=True)
class Added:
    """A recording with an effect of these `values` added to the machine that is believed in.

    The first of them is what is asked for, `believed` what it would be without, and `unit` that of both. It comes
    `instead` of what the recording has of it, or else on top.
    """

    effect: str
    values: Mapping[str, float]
    believed: float
    unit: str
    recording: Recording
    instead: bool = False

    @property
    def parameter(self) -> str:
        return next(iter(self.values))

    @property
    def size(self) -> float:
        """What is added."""
        return self.values[self.parameter] - self.believed


def with_effects(recording: JointRecording, report: Mapping[str, Any]) -> Iterator[Added]:
    """A log of currents, torques, forces or targets with each effect added, one at a time, that can be.

    `report` is of the log as it is. None to a log whose drive is off at times: it does not follow its command then.
    """
    if recording.supply is not None and not recording.supply.all():
        return
    log, nominal = _Log.of(recording, report), recording.nominal

    def added(effect: str, values: Mapping[str, float], believed: float, changed: JointRecording) -> Added:
        first = JOINT_EFFECTS[effect].parameter(next(iter(values)))
        return Added(effect, values, believed, unit(first, recording.units), changed)

    for effect, (values, command) in log.commands().items():
        believed = nominal.get("coulomb_friction" if "static" in values else effect, 0.0)
        yield added(effect, values, believed, replace(recording, command=command))
    if not recording.servo:  # which would have followed what its encoder shows
        step = log.travel / STEPS
        shown = np.round(recording.position / step) * step
        changed = replace(recording, position=shown, velocity=None)
        yield added("encoder_quantization", {"resolution": step}, 0.0, changed)


@dataclass(frozen=True)
class _Log:
    """Torques at the drive, positions, velocities and accelerations [E, T], 0 beyond an episode's end.

    They are means over the time that a row's command acts, which is until the next.
    """

    recording: JointRecording
    u: np.ndarray
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    damping: float  # as the diagnosis of the log finds it

    @classmethod
    def of(cls, recording: JointRecording, report: Mapping[str, Any]) -> "_Log":
        half = max(round(SMOOTHED / recording.sample_time), LEAST_ROWS)
        velocity = episode_slopes(recording.position, recording.time, recording.lengths, half)
        acceleration = episode_slopes(velocity, recording.time, recording.lengths, half)
        q, v, a = (_until_next(each) for each in (recording.position, velocity, acceleration))
        nominal, factor = NominalJoint(**recording.nominal), _gains(recording)
        u = nominal.asked(recording.command, q, v, factor) if recording.servo else recording.command
        found = _found(report, "viscous_damping", "value")
        damping = float(found["value"]) if found else nominal.viscous_damping
        return cls(recording, nominal.torque_constant * u, q, v, a, damping)

    @property
    def travel(self) -> float:
        return float(np.nanmax(self.recording.position) - np.nanmin(self.recording.position))

    def commands(self) -> dict[str, tuple[dict[str, float], np.ndarray]]:
        """By effect: its values, and the commands [E, T] that a drive which has it would have been given."""
        command, step = self.recording.command, self.recording.sample_time
        rows = max(round(LATE / step), 1)
        late = np.concatenate([command[:, rows:], np.repeat(command[:, -1:], rows, axis=1)], axis=1)
        asked = {effect: (values, command + more / self.gain) for effect, (values, more) in self.torques().items()}
        return asked | {"latency": ({"delay": rows * step}, late)}

    @property
    def gain(self) -> np.ndarray:
        """The torques [E, 1] that one unit of the command asks for."""
        had = self.recording.nominal
        return had["torque_constant"] * had.get("proportional_gain", 1.0) * _gains(self.recording)

    def torques(self) -> dict[str, tuple[dict[str, float], np.ndarray]]:
        """By effect: its values, and the torques [E, T] that a drive which has it is asked for besides."""
        u, q, v, time, had = self.u, self.q, self.v, self.recording.time, self.recording.nominal
        share = OF_A_SERVO if self.recording.servo else SHARE
        torque, speed = share * _usual(u), _usual(v)
        direction, damping = np.tanh(v / (NEAR_REST * speed)), torque / speed
        teeth = min(2 * np.pi * PERIODS / self.travel, A_ROW / (speed * self.recording.sample_time))
        rest = OFTEN * speed
        rising = 2 * damping / (self.damping * float(time.max())) if self.damping else 0.0

        def more(name: str, size: float) -> dict[str, float]:
            return {"value": had[name] + size}

        gain, zero = ("proportional_gain", q) if self.recording.servo else ("torque_constant", 0.0)
        pull = self.gain * (self.recording.command - zero)
        drift = {"thermal_drift": ({"rate": rising}, self.damping * rising * time * v)}
        # A motion sticks and lets go within a row of a servo's log, which the next target is too late for.
        sticking = {
            "stribeck_friction": (
                {"static": had["coulomb_friction"] + RISING * torque, "velocity": rest},
                RISING * torque * np.exp(-((v / rest) ** 2)) * direction,
            )
        }
        return (
            {
                "viscous_damping": (more("viscous_damping", damping), damping * v),
                "coulomb_friction": (more("coulomb_friction", torque), torque * direction),
                "bias_torque": (more("bias_torque", torque), np.full_like(u, torque)),
                "inertia": (more("inertia", share * had["inertia"]), share * had["inertia"] * self.a),
                gain: (more(gain, share * had[gain]), pull / (1 + share) - pull),
                "asymmetric_friction": ({"viscous": damping, "coulomb": 0.0}, damping * np.abs(v)),
                "load_dependent_friction": ({"coefficient": share}, u / (1 - share * np.sign(u) * direction) - u),
                "cogging": ({"amplitude": torque, "teeth": teeth}, -torque * np.sin(teeth * q)),
            }
            | ({} if self.recording.servo else sticking)
            | (drift if rising else {})
        )


def _gains(recording: JointRecording) -> np.ndarray:
    """Factors [E, 1] of a servo's gains."""
    return np.ones((len(recording), 1)) if recording.gains is None else recording.gains[:, None]


def _until_next(values: np.ndarray) -> np.ndarray:
    """Means [E, T] of each row and the next of the values; 0 beyond an episode's end, where there are none."""
    following = np.concatenate([values[:, 1:], values[:, -1:]], axis=1)
    following = np.where(np.isnan(following), values, following)
    return np.nan_to_num((values + following) / 2)


def _usual(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def measured(added: Added, report: Mapping[str, Any], without: Mapping[str, Any]) -> dict[str, Any]:
    """What the `report` of a log with an effect added says of it, beside that of the log `without`."""
    found, before = (_found(each, added.effect, added.parameter) for each in (report, without))
    named = {each["name"]: each["share"] for each in report["effects"]}
    return {
        "effect": added.effect,
        "size": added.size,
        "unit": added.unit,
        "from": before["value"] if before and not added.instead else added.believed,
        "found": found,
        "share": named.get(added.effect),
        "others": sorted(named.keys() - {added.effect} - {each["name"] for each in without["effects"]}),
        "gap": report["gap"],
    }


def _found(report: Mapping[str, Any], effect: str, parameter: str) -> Mapping[str, Any] | None:
    """The parameter in a report, with its unit and interval: named, or refitted without a name."""
    for each in (*report["effects"], *report["refitted"]):
        if each["name"] == effect:
            found: Mapping[str, Any] = each["parameters"][parameter]
            return found
    return None
