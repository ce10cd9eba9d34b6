"""Recordings of the real thing, and what the simulator believed of it: folders, read into arrays and checked.

`read(folder)` gives a `JointRecording`, a `CameraRecording`, a `ContactRecording` or an `ArmRecording`; whatever is
wrong with a folder is one `UserError`.
"""

from vision_s2r.recording.data import (
    ArmRecording,
    CameraRecording,
    ContactRecording,
    JointRecording,
    Recording,
    split,
)
from vision_s2r.recording.read import read
from vision_s2r.recording.write import write

__all__ = [
    "ArmRecording",
    "CameraRecording",
    "ContactRecording",
    "JointRecording",
    "Recording",
    "read",
    "split",
    "write",
]
