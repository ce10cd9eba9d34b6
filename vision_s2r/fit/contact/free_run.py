"""A recording of tosses through the simulator, in windows that each begin at the measured state."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.contact import pack, simulate
from vision_s2r.fit.case import Values
from vision_s2r.fit.contact.windows import make_track
from vision_s2r.recording import ContactRecording

WINDOW = 0.25  # s


@dataclass(frozen=True)
class ContactRun:
    """What a simulation makes of E episodes of T samples; NaN beyond an episode's end."""

    position: np.ndarray  # [E, T, 3] m
    angle: np.ndarray  # [E, T] rad, between measured and predicted attitude
    window: np.ndarray  # [E, T] int64: number of the window within its episode, -1 beyond the end


def windowed(recording: ContactRecording, effects: Values) -> ContactRun:
    """The recording's windows under these effects."""
    track = make_track(recording)
    length = max(1, round(WINDOW / recording.sample_time))
    episodes, samples = recording.position.shape[:2]
    window = np.where(np.arange(samples) < recording.lengths[:, None], np.arange(samples) // length, -1)
    starts = np.array([(e, k) for e in range(episodes) for k in range(0, int(recording.lengths[e]), length)])
    first = track.states.state[starts[:, 0], starts[:, 1]].copy()
    first[:, 7:] = np.where(np.isfinite(first[:, 7:]), first[:, 7:], 0.0)
    machine = pack(track.nominal, effects)[None]
    states = simulate(machine, recording.shape, first, length, recording.sample_time)[0]
    position = np.full(recording.position.shape, np.nan)
    attitude = np.full(recording.attitude.shape, np.nan)
    for (e, k), rows in zip(starts, states, strict=True):
        end = min(k + length, int(recording.lengths[e]))
        position[e, k:end], attitude[e, k:end] = rows[: end - k, :3], rows[: end - k, 3:7]
    position[..., 2] += track.support
    inside = window >= 0
    angle = np.full((episodes, samples), np.nan)
    turn = Rotation.from_quat(recording.attitude[inside]) * Rotation.from_quat(attitude[inside]).inv()
    angle[inside] = turn.magnitude()
    return ContactRun(position, angle, window)
