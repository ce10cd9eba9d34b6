"""A log through the simulator, which only knows the commands and each episode's first row; and how far it is off."""

import hashlib

import numpy as np

from vision_s2r.fit.case import Values
from vision_s2r.fit.joint.slopes import slopes
from vision_s2r.fit.joint.track import thinning
from vision_s2r.joint import NominalJoint, pack, simulate
from vision_s2r.recording import JointRecording

REACH = 2  # samples to either side (of those that a fit looks at) over which a velocity is read off positions


def free_run(recording: JointRecording, effects: Values) -> np.ndarray:
    """Position and velocity [E, T, 2] of a simulation that only knows the commands and each episode's first row."""
    machine = pack(NominalJoint(**recording.nominal), effects)[None]
    return simulate(
        machine,
        recording.command,
        recording.first,
        recording.sample_time,
        times=recording.times,
        scale=recording.supply,
        external=recording.external,
        load_inertia=recording.load_inertia,
        gains=recording.gains,
        lengths=recording.lengths,
    )[0]


def measured(recording: JointRecording) -> np.ndarray:
    """Position and velocity [E, T, 2]; a velocity that was not recorded is read off the positions."""
    velocity = recording.velocity
    if velocity is None:
        velocity = slope_of(recording, recording.position)
    return np.stack([recording.position, velocity], axis=-1)


def gap_metric(recording: JointRecording) -> tuple[str, str]:
    """Which gap a recording has, and its unit: a servo's is of the position, its task; else of the velocity."""
    length = "rad" if recording.units == "rotary" else "m"
    return ("position_rmse", length) if recording.servo else ("velocity_rmse", f"{length}/s")


def gap_errors(recording: JointRecording, states: np.ndarray) -> np.ndarray:
    """Squared errors [E, T] of the gap's metric, of states [E, T, 2] of a free run; NaN beyond an episode's end."""
    if recording.servo:
        return (recording.position - states[..., 0]) ** 2
    if recording.velocity is not None:
        return (recording.velocity - states[..., 1]) ** 2
    return (slope_of(recording, recording.position) - slope_of(recording, states[..., 0])) ** 2


def slope_of(recording: JointRecording, position: np.ndarray) -> np.ndarray:
    """Velocity [E, T] that positions [E, T] of a recording show; NaN beyond an episode's end."""
    half, out = REACH * thinning(recording), np.full(position.shape, np.nan)
    for k, length in enumerate(recording.lengths):
        reach = min(half, (length - 1) // 2)
        out[k, :length] = slopes(position[k, :length], recording.time[k, :length], reach) if reach else 0.0
    return out


def fingerprint(recording: JointRecording) -> str:
    """What tells a recording from every other."""
    digest = hashlib.sha256()
    for values in (recording.command, recording.position, recording.time, recording.lengths):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
