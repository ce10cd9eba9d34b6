"""What recordings show of their sensors: an encoder's steps, and how late a speed register is."""

from collections.abc import Sequence
from typing import Any

from vision_s2r.fit.joint.quantization import find_quantization_grid
from vision_s2r.hardware.machines import MachineRecordings
from vision_s2r.recording import JointRecording, read


def sensor_table(found: Sequence[MachineRecordings]) -> dict[str, Any]:
    """Of every recording of joints: the step and what it lies beside its multiples, and why a column is left out."""
    rows: list[list[Any]] = []
    for machine in found:
        for motion, path in machine.recordings.items():
            recording = read(path)
            if isinstance(recording, JointRecording):
                rows.append([f"{machine.name}, {motion}", *_steps(recording), _speed(recording)])
    return {
        "command": "vision-s2r hardware path=DIR",
        "source": "read from the logs, nothing fitted; mrad, or mm",
        "columns": ["recording", "encoder's step", "beside its multiples", "speed register"],
        "rows": rows,
    }


def _steps(recording: JointRecording) -> tuple[str, str]:
    grid = find_quantization_grid(recording.position, recording.lengths)
    return ("none seen", "–") if grid is None else (f"{1e3 * grid.resolution:.4g}", f"{1e3 * grid.offset:.3g}")


def _speed(recording: JointRecording) -> str:
    if recording.velocity is not None:
        return "used"
    return recording.left_out.get("velocity", "none").partition(", which")[0]
