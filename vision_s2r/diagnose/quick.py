"""A quick look: a part of the recording, and of the sets of effects only the most promising."""

from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from vision_s2r.diagnose.config import SearchConfig
from vision_s2r.recording import CameraRecording, ContactRecording, JointRecording, split

Some: TypeAlias = JointRecording | CameraRecording | ContactRecording
PART = 1 / 3  # of a recording, that is looked at
LEAST_ROWS, LEAST_UNITS = 120, 6  # of an episode; tosses or pairs of pictures


def quickly(limits: SearchConfig) -> SearchConfig:
    """A search that tries little beside the most promising set of each size."""
    return replace(limits, beam=1, breadth=min(limits.breadth, 3), contenders=1, hidden=False)


def part_of(recording: Some) -> Some:
    """The first rows of each of a joint's episodes, or tosses or pairs of pictures from all over a recording.

    Unpaired pictures, and joints under the loads of an arm, stay whole.
    """
    if isinstance(recording, JointRecording):
        return recording if recording.load_inertia is not None else _first_rows(recording)
    if isinstance(recording, CameraRecording) and recording.pairing == "unpaired":
        return recording
    count = max(int(np.ceil(PART * len(recording))), min(LEAST_UNITS, len(recording)))
    units: Any = recording
    some: Some = split(units, list(np.linspace(0, len(recording) - 1, count).round().astype(int)))
    return some


def _first_rows(recording: JointRecording) -> JointRecording:
    lengths = np.minimum(recording.lengths, np.maximum(np.ceil(PART * recording.lengths).astype(np.int64), LEAST_ROWS))
    beyond = np.arange(recording.position.shape[1]) >= lengths[:, None]

    def ended(values: np.ndarray, fill: float) -> np.ndarray:
        return np.where(beyond, fill, values)

    whole = replace(
        recording,
        lengths=lengths,
        command=ended(recording.command, 0.0),
        position=ended(recording.position, np.nan),
        velocity=None if recording.velocity is None else ended(recording.velocity, np.nan),
    )
    return split(whole, range(len(whole)))  # cut to the longest
