"""Recordings of the real thing, and what the simulator believed of it: folders, read into arrays and checked.

`read(folder)` gives a `JointRecording`, a `CameraRecording`, a `ContactRecording` or an `ArmRecording`; whatever is
wrong with a folder is one `UserError`. `from_arrays`, `from_table` and `from_pictures` take what is in memory.
"""

from vision_s2r.recording.arrays import from_arrays, from_pictures, from_table
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
    "from_arrays",
    "from_pictures",
    "from_table",
    "read",
    "split",
    "write",
]
