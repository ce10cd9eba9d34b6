"""Several recordings of one joint, or of one arm, as one."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.recording.data import ArmRecording, JointRecording
from vision_s2r.recording.joint import CONTROL, NOMINAL
from vision_s2r.recording.read import read

OPTIONAL = ("velocity", "supply", "external", "load_inertia")  # which all have, or none

GAINS = ("proportional_gain", "derivative_gain")  # nominal values of a servo
ALIKE = 1e-3  # relative: clocks of two runs at one rate, which each recording's mean step shows


def joined(recordings: Sequence[JointRecording]) -> JointRecording:
    """The episodes of recordings of one joint, numbered from 0 in the order given.

    Where times are even in all, the first recording's step is taken for all. A servo may have had other gains in some,
    both by one factor. Raises UserError where they are not of one simulator, sampled alike, with the same columns.
    """
    recordings, gains = _of_one_gain(recordings)
    first = recordings[0]
    for other in recordings[1:]:
        for (name, one), two in zip(_simulator(first).items(), _simulator(other).values(), strict=True):
            if one != two and not (name == "sample_time" and abs(two / one - 1) < ALIKE):
                raise UserError(
                    f"recordings differ in {name}, {one} and {two}: expected recordings of one joint, alike"
                )
        for name in OPTIONAL:
            if (getattr(first, name) is None) != (getattr(other, name) is None):
                raise UserError(f"some recordings have {name}, others have none: expected the same columns in all")
    samples = max(each.position.shape[1] for each in recordings)

    def stacked(name: str, fill: float) -> np.ndarray:
        padded = []
        for each in recordings:
            values, length = getattr(each, name), each.position.shape[1]
            more = (samples - length) * (values.shape[1] // length)  # loads may have several values a sample
            padded.append(np.pad(values, ((0, 0), (0, more)), constant_values=fill))
        return np.concatenate(padded)

    optional = {"velocity": np.nan, "supply": 1.0, "external": 0.0, "load_inertia": 0.0}
    given: dict[str, Any] = {
        name: stacked(name, fill) for name, fill in optional.items() if getattr(first, name) is not None
    }
    lengths = np.concatenate([each.lengths for each in recordings])
    return replace(
        first,
        start_velocity=np.concatenate([each.first[:, 1] for each in recordings]),
        command=stacked("command", 0.0),
        position=stacked("position", np.nan),
        lengths=lengths,
        episodes=tuple(range(len(lengths))),
        times=_times(recordings, samples) if any(each.times is not None for each in recordings) else None,
        gains=gains,
        source=np.repeat(np.arange(len(recordings)), [len(each) for each in recordings]),
        left_out={name: why for each in recordings for name, why in each.left_out.items()},
        **given,
    )


def _of_one_gain(recordings: Sequence[JointRecording]) -> tuple[list[JointRecording], np.ndarray | None]:
    """The recordings, servos with the first one's gains where both are by one factor others; and each episode's factor.

    None where it is 1 everywhere.
    """
    if not all(each.servo for each in recordings):
        return list(recordings), None
    law = {name: recordings[0].nominal[name] for name in GAINS if name in recordings[0].nominal}
    alike, gains = [], []
    for each in recordings:
        factor = each.nominal[GAINS[0]] / law[GAINS[0]]
        own = np.ones(len(each)) if each.gains is None else each.gains
        if all(math.isclose(each.nominal.get(name, 0.0), factor * value) for name, value in law.items()):
            each, own = replace(each, nominal=each.nominal | law), factor * own
        alike.append(each)
        gains.append(own)
    factors = np.concatenate(gains)
    return alike, None if (factors == 1).all() else factors


def read_together(folders: Sequence[Path], hold_out: bool = True) -> JointRecording | ArmRecording:
    """The recordings in these folders as one, of one joint or of one arm, which share all that a simulator has.

    Raises UserError as `read` and `joined` do, and where they are of another kind.
    """
    recordings = [read(folder, hold_out) for folder in folders]
    if all(isinstance(each, JointRecording) for each in recordings):
        return replace(joined(cast(list[JointRecording], recordings)), source=None)
    if all(isinstance(each, ArmRecording) for each in recordings):
        return joined_arms(cast(list[ArmRecording], recordings))
    kinds = ", ".join(each.kind for each in recordings)
    raise UserError(f"together: recordings of kind {kinds}, expected all of one joint, or all of one arm")


def joined_arms(recordings: Sequence[ArmRecording]) -> ArmRecording:
    """As `joined`, of recordings of one arm. Raises UserError as it does, naming the joint."""
    first = recordings[0]
    for other in recordings[1:]:
        if other.model.read_bytes() != first.model.read_bytes():
            raise UserError(f"recordings differ in their model, {first.model} and {other.model}: expected one arm")
        for name in ("modes", "hold", "tip"):
            if (one := getattr(first, name)) != (two := getattr(other, name)):
                raise UserError(f"recordings differ in {name}, {one} and {two}: expected recordings of one arm, alike")
    joints = {}
    for name in first.joints:
        try:
            joints[name] = replace(joined([each.joints[name] for each in recordings]), source=None)
            if joints[name].gains is not None:
                raise UserError("recordings differ in the servo's gains, expected recordings of one arm, alike")
        except UserError as error:
            raise UserError(f"joint {name}: {error}") from error
    samples = max(each.any.position.shape[1] for each in recordings)
    torque = {
        name: _padded([each.torque[name] for each in recordings], samples)
        for name in first.torque
        if all(name in each.torque for each in recordings)
    }
    return replace(first, joints=joints, torque=torque)


def _padded(values: Sequence[np.ndarray], samples: int) -> np.ndarray:
    """[E, samples] of several [E, T]; NaN after the end."""
    return np.concatenate(
        [np.pad(each, ((0, 0), (0, samples - each.shape[1])), constant_values=np.nan) for each in values]
    )


def _simulator(recording: JointRecording) -> dict[str, Any]:
    """What recordings of one joint have in common."""
    nominal = {f"nominal {name}": recording.nominal.get(name) for name in (*NOMINAL, *CONTROL.values())}
    return {"units": recording.units, "sample_time": recording.sample_time} | nominal


def _times(recordings: Sequence[JointRecording], samples: int) -> np.ndarray:
    """[E, samples]; they go on after the end of an episode as they are to."""
    parts = []
    for each in recordings:
        more = np.arange(1, samples - each.time.shape[1] + 1) * each.sample_time
        parts.append(np.concatenate([each.time, each.time[:, -1:] + more], axis=1))
    return np.concatenate(parts)
