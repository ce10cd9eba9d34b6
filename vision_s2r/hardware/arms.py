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
from vision_s2r.recording import ArmRecording, Recording, read
from vision_s2r.recording.joined import read_together
from vision_s2r.recording.pieces import Rows, without
from vision_s2r.report.reading import diagnosed, read_report, values

REPORT = "report.json"


def is_arm(machine: MachineRecordings) -> bool:
    """Whether these are recordings of a whole arm."""
    return all(isinstance(read(path), ArmRecording) for path in machine.recordings.values())


def folder_of(motions: Sequence[str]) -> str:
    """What the folder of a diagnosis is called."""
    return "+".join(motions).replace(" ", "_")


def diagnosed_motions(machine: MachineRecordings, folder: Path) -> dict[tuple[str, ...], Path]:
    """Folders below this one of diagnoses of motions, each alone or together.

    What was of a motion that is not there any more tells nothing.
    """
    called = {folder_of([name]): name for name in machine.recordings}
    found = {each: each.name.split("+") for each in sorted(folder.glob("*"))}
    return {tuple(called[part] for part in parts): each for each, parts in found.items() if called.keys() >= {*parts}}


def diagnose_arm_of(machine: MachineRecordings, motions: Sequence[str], folder: Path, jobs: int) -> None:
    """The diagnosis of one motion, or of several together, unless it stands there: it takes minutes."""
    if not (folder / REPORT).exists():
        together = read_together([machine.recordings[motion] for motion in motions])
        diagnose(together, DiagnoseConfig(), jobs).save(folder)


def measured_arms(machine: MachineRecordings, folder: Path) -> list[dict[str, Any]]:
    """Each diagnosis of an arm below a folder, and its errors on all motions.

    Of one motion, its own are on stretches held out. The others' are with nothing refitted, and without the rows in
    which a motion's own diagnosis found that the tip touches something; those of several together, too.
    """
    folders = diagnosed_motions(machine, folder)
    reports = {motions: read_report(each / REPORT) for motions, each in folders.items() if (each / REPORT).exists()}
    left_out = {motions: report["held_out"].get("without") or [] for motions, report in reports.items()}
    recordings = {name: read(path) for name, path in machine.recordings.items()}
    return [_measured(machine.name, motions, report, recordings, left_out) for motions, report in reports.items()]


def _measured(
    machine: str,
    motions: tuple[str, ...],
    report: Mapping[str, Any],
    recordings: Mapping[str, Recording],
    left_out: Mapping[tuple[str, ...], Rows],
) -> dict[str, Any]:
    effects, errors = values(diagnosed(report)), {}
    for name, recording in recordings.items():
        assert isinstance(recording, ArmRecording)
        own = motions == (name,)  # which its replay knows to shorten
        rest = recording if own else without(recording, left_out.get((name,), []))
        found = replay_arm(rest, effects, report["held_out"])[1]
        errors[name] = {"joints": found["joints"], "gap": found["gap"], "tip": found["gaps"].get("tip")}
    return {
        "machine": machine,
        "motion": " + ".join(motions),
        "from": list(motions),
        "verdict": report["verdict"],
        "touches": report.get("touches"),
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
                f"{each['verdict'].replace('_', ' ')}: {names or 'no name'}{_touches(each['touches'])}",
                *(_cell(each["errors"][name], name in each["from"]) for name in motions),
                _mean([error for name, error in each["errors"].items() if name not in each["from"]]),
            ]
        )
    together = (f"'together=[{','.join(each['from'])}]'" for each in measured if len(each["from"]) > 1)
    return {
        "command": " and ".join(["vision-s2r hardware path=DIR", *together]),
        "source": "root mean square in a free run of the whole arm, of all joints, mrad, and of the tip, mm: believed "
        "→ diagnosed; what was diagnosed itself (*) on stretches that no fit has seen, or, where several motions were "
        "together, as fitted to these; others with nothing refitted; without rows in which a motion's own diagnosis "
        "has the tip touch something",
        "columns": ["from", "diagnosis", *motions, "mean of the others"],
        "rows": rows,
    }


def _touches(found: Mapping[str, Any] | None) -> str:
    return f" (the tip touches something in {found['share']:.0%} of the rows)" if found else ""


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
