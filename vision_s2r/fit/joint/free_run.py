"""A log through the simulator, which only knows the commands and each episode's first row."""

import numpy as np

from vision_s2r.fit.case import Values
from vision_s2r.joint import Nominal, pack, simulate
from vision_s2r.recording import JointRecording


def free_run(recording: JointRecording, effects: Values) -> np.ndarray:
    """Position and velocity [E, T, 2] of a simulation that only knows the commands and each episode's first row."""
    machine = pack(Nominal(**recording.nominal), effects)[None]
    return simulate(
        machine,
        recording.command,
        recording.first,
        recording.sample_time,
        times=recording.times,
        scale=recording.supply,
        external=recording.external,
        lengths=recording.lengths,
    )[0]


def measured(recording: JointRecording) -> np.ndarray:
    """Position and velocity [E, T, 2]; a velocity that was not recorded is the position's central difference."""
    velocity = recording.velocity
    if velocity is None:
        velocity = np.full_like(recording.position, np.nan)
        for k, length in enumerate(recording.lengths):
            velocity[k, :length] = np.gradient(recording.position[k, :length], recording.time[k, :length])
    return np.stack([recording.position, velocity], axis=-1)
