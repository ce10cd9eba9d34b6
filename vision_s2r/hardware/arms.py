"""A measured arm: diagnosed from one motion, and tried on its other motions."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.diagnose.arm_replay import replay_arm
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.hardware.machines import MachineRecordings
from vision_s2r.hardware.tables import named
from vision_s2r.recording import ArmRecording, read
from vision_s2r.recording.joined import read_together
from vision_s2r.report.reading import diagnosed, read_report, values


def is_arm(machine: MachineRecordings) -> bool:
    """Whether these are recordings of a whole arm."""
    return all(isinstance(read(path), ArmRecording) for path in machine.recordings.values())


def measured_arm(machine: MachineRecordings, motions: Sequence[str], folder: Path, jobs: int) -> dict[str, Any]:
    """The diagnosis of one motion or of several together, and errors on all: of one, its own on stretches held out.

    The others' are with nothing refitted; those of several together, too.

    A report that stands in the folder already, which takes a quarter of an hour, is not made again.
    """
    if not (folder / "report.json").exists():
        together = read_together([machine.recordings[motion] for motion in motions])
        diagnose(together, DiagnoseConfig(), jobs).save(folder)
    report = read_report(folder / "report.json")
    effects = values(diagnosed(report))
    errors = {}
    for name, path in machine.recordings.items():
        recording = read(path)
        assert isinstance(recording, ArmRecording)
        found = replay_arm(recording, effects, report["held_out"])[1]
        errors[name] = {"joints": found["joints"], "gap": found["gap"], "tip": found["gaps"].get("tip")}
    return {
        "machine": machine.name,
        "motion": " + ".join(motions),
        "from": list(motions),
        "verdict": report["verdict"],
        "effects": [
            {key: each.get(key) for key in ("name", "joint", "share", "parameters")} for each in report["effects"]
        ],
        "errors": errors,
    }


def arm_table(measured: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Every motion: what was named, and errors on itself and each other motion, believed and diagnosed."""
    motions = sorted({name for each in measured for name in each["errors"]})
    rows: list[list[Any]] = []
    for each in measured:
        names = "; ".join(
            f"{effect['joint'] + ': ' if effect['joint'] else ''}{named(effect)}" for effect in each["effects"]
        )
        rows.append(
            [
                each["motion"],
                f"{each['verdict'].replace('_', ' ')}: {names or 'no name'}",
                *(_cell(each["errors"][name], name in each["from"]) for name in motions),
                _mean([error for name, error in each["errors"].items() if name not in each["from"]]),
            ]
        )
    return {
        "command": "vision-s2r hardware path=DIR",
        "source": "root mean square in a free run of the whole arm, of all joints, mrad, and of the tip, mm: believed "
        "→ diagnosed; what was diagnosed itself (*) on stretches that no fit has seen, or, where several motions were "
        "together, as fitted to these; others with nothing refitted",
        "columns": ["from", "diagnosis", *motions, "mean of the others"],
        "rows": rows,
    }


def _cell(error: Mapping[str, Any], own: bool) -> str:
    gap, tip = error["gap"], error["tip"]
    far = f"; {tip['before']:.1f} → {tip['after']:.1f} mm" if tip else ""
    return f"{1e3 * gap['before']:.1f} → {1e3 * gap['after']:.1f}{far}{' *' if own else ''}"


def _mean(errors: Sequence[Mapping[str, Any]]) -> str:
    """Of the errors of several motions, each of which counts the same."""
    if not errors:
        return "–"
    gap = {key: float(np.mean([each["gap"][key] for each in errors])) for key in ("before", "after")}
    tips = [each["tip"] for each in errors if each["tip"]]
    tip = {key: float(np.mean([each[key] for each in tips])) for key in ("before", "after")} if tips else None
    return _cell({"gap": gap, "tip": tip}, own=False)
