"""A log of an arm through the simulator, which only knows the commands and each episode's first row."""

import hashlib
from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np

from vision_s2r.arm.bodies import Bodies
from vision_s2r.arm.effect import of_bodies
from vision_s2r.arm.model import opened
from vision_s2r.arm.simulate import ArmRun, parts_of, simulate
from vision_s2r.fit.case import Values
from vision_s2r.fit.joint.free_run import fingerprint as of_joint
from vision_s2r.fit.joint.noise import position_noise
from vision_s2r.joint import NominalJoint, pack
from vision_s2r.recording import ArmRecording


class FreeRuns:
    """Simulations of the episodes of a recording, each made once."""

    def __init__(self, recording: ArmRecording) -> None:
        self.recording = recording
        self._machines: dict[str, tuple[Bodies, np.ndarray, int]] = {}
        self._runs: dict[tuple[str, int], ArmRun] = {}

    @cached_property
    def noise(self) -> np.ndarray:
        """Standard deviations [J] (rad, m) of what the measured positions do not show."""
        measured, simulated = self.recording.position, self.states({})[..., 0]
        with np.errstate(over="ignore", invalid="ignore"):  # a simulation may have run away
            pairs = zip(np.moveaxis(measured, -1, 0), np.moveaxis(simulated, -1, 0), strict=True)
            return np.array([position_noise(*each) for each in pairs])

    def run(self, effects: Values, k: int, rows: int | None = None) -> ArmRun:
        """Episode `k` of the arm with these effects, the first `rows` rows of it at least."""
        key = repr(sorted((name, sorted(values.items())) for name, values in effects.items()))
        length = int(self.recording.any.lengths[k]) if rows is None else rows
        if (key, k) not in self._runs or self._runs[key, k].states.shape[1] < length:
            if key not in self._machines:
                self._machines[key] = self._made(effects)
            bodies, machines, parts = self._machines[key]
            command = np.array([joint.command[k] for joint in self.recording.joints.values()])
            times = self._times(k)
            command = command[:, : len(times)]
            self._runs[key, k] = simulate(bodies, machines, command, self._first(k), times, parts, rows=length)
        return self._runs[key, k]

    def states(self, effects: Values) -> np.ndarray:
        """Positions and velocities [E, T, J, 2] of all episodes; NaN after an episode's end."""
        out = self._nothing()
        for k, states in enumerate(out):
            found = self.run(effects, k).states
            states[: found.shape[1]] = found.transpose(1, 0, 2)
        return out

    def error(self, joint: str, effects: Values) -> float:
        """Mean squared error of a joint's position, rad² or m²; infinite where the simulation ran away."""
        j = list(self.recording.joints).index(joint)
        with np.errstate(over="ignore"):
            errors = gap_errors(self.recording, self.states(effects))[..., j]
        measured = np.isfinite(self.recording.position[..., j])
        return float(np.where(np.isfinite(errors), errors, np.inf)[measured].mean())

    def held_out(self, held_out: Mapping[str, Any]) -> np.ndarray:
        """As `states`, each stretch with parameters that have not seen it, as a report's `held_out` has them."""
        out = self._nothing()
        for episode, first, end, fold in sorted(held_out["segments"], key=lambda segment: -segment[2]):
            e = self.recording.episodes.index(episode)
            out[e, first:end] = self.run(held_out["folds"][fold], e, end).states[:, first:end].transpose(1, 0, 2)
        return out

    def _made(self, effects: Values) -> tuple[Bodies, np.ndarray, int]:
        """The arm with these effects, and steps between two rows: as many in all episodes, wherever they begin."""
        joints, bodies = self.recording.joints.items(), bodies_of(self.recording, effects)
        packed = np.array([pack(NominalJoint(**joint.nominal), effects_of(name, effects)) for name, joint in joints])
        episodes = range(len(self.recording))
        return bodies, packed, max(parts_of(bodies, packed, self._first(k), self._times(k)) for k in episodes)

    def _first(self, k: int) -> np.ndarray:
        """Positions and velocities [J, 2] with which an episode begins."""
        return np.array([joint.first[k] for joint in self.recording.joints.values()])

    def _times(self, k: int) -> np.ndarray:
        return np.array(self.recording.any.time[k, : int(self.recording.any.lengths[k])])

    def _nothing(self) -> np.ndarray:
        return np.full((*self.recording.any.position.shape, len(self.recording.joints), 2), np.nan)


def free_run(recording: ArmRecording, effects: Values) -> np.ndarray:
    """Positions and velocities [E, T, J, 2] of a simulation of the whole arm; NaN after an episode's end."""
    return FreeRuns(recording).states(effects)


def bodies_of(recording: ArmRecording, effects: Values) -> Bodies:
    """The recording's bodies, with those effects that change them."""
    model = opened(recording.model)
    return Bodies(model, list(recording.joints), recording.hold, recording.tip, of_whole(effects))


def of_whole(effects: Values) -> dict[str, Mapping[str, float]]:
    """Of the effects of an arm, those that change its bodies."""
    return {name: values for name, values in effects.items() if of_bodies(name)}


def effects_of(joint: str, effects: Values) -> dict[str, dict[str, float]]:
    """Of the effects of an arm, those of one joint, by their own names."""
    own = (key for key in effects if key.rpartition(".")[0] == joint)
    return {key.rpartition(".")[2]: dict(effects[key]) for key in own}


def gap_errors(recording: ArmRecording, states: np.ndarray) -> np.ndarray:
    """Squared errors [E, T, J] of the positions of a free run [E, T, J, 2], rad² or m²; NaN after an episode's end."""
    return (recording.position - states[..., 0]) ** 2


def by_stretch(recording: ArmRecording, values: np.ndarray, held_out: Mapping[str, Any]) -> np.ndarray:
    """Means [S, J] of values [E, T, J] over the stretches of a report's `held_out`."""
    segments = held_out["segments"]
    rows = [(recording.episodes.index(episode), first, end) for episode, first, end, _ in segments]
    return np.array([np.nanmean(values[e, first:end], axis=0) for e, first, end in rows])


def tip_errors(recording: ArmRecording, effects: Values, states: np.ndarray) -> np.ndarray | None:
    """Distance [E, T] (m) of the tip from where the measured joints put it; None where the tip is not known.

    Of both, the bodies are the model's: what the model has wrong about lengths is not in it.
    """
    if recording.tip is None:
        return None
    there, here = (tips(recording, effects, each) for each in (recording.position, states[..., 0]))
    return np.linalg.norm(here - there, axis=-1)


def tips(recording: ArmRecording, effects: Values, positions: np.ndarray) -> np.ndarray:
    """Where the tip is [E, T, 3] (m) at positions [E, T, J], of a recording that says what it is; NaN after the end."""
    bodies, out = bodies_of(recording, effects), np.full((*positions.shape[:2], 3), np.nan)
    for row, each, length in zip(out, positions, recording.any.lengths, strict=True):
        row[:length] = bodies.tip(each[:length])
    return out


def heights(recording: ArmRecording, positions: np.ndarray) -> np.ndarray | None:
    """How high the tip is [...] (m), against gravity, at positions [..., J]; NaN where these are not known.

    None of a recording that doesn't say what its tip is, and without gravity.
    """
    gravity = np.array(opened(recording.model).spec.option.gravity)
    if recording.tip is None or not gravity.any():
        return None
    out, known = np.full(positions.shape[:-1], np.nan), np.isfinite(positions).all(axis=-1)
    places = bodies_of(recording, {}).tip(positions[known])
    assert places is not None
    out[known] = places @ (-gravity / np.linalg.norm(gravity))
    return out


def fingerprint(recording: ArmRecording) -> str:
    """What tells a recording from every other."""
    return hashlib.sha256("".join(map(of_joint, recording.joints.values())).encode()).hexdigest()
