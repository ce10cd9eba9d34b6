"""Every recording of measured machines: diagnosed, and tried on those of the same machine that it has not seen."""

import json
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.errors import UserError
from vision_s2r.files import write
from vision_s2r.fit.case import NOMINAL, Values
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.free_run import free_run, gap_errors
from vision_s2r.hardware import added, added_pictures, bam
from vision_s2r.hardware.arms import (
    REPORT,
    arm_table,
    diagnose_arm_of,
    diagnosed_motions,
    folder_of,
    is_arm,
    measured_arms,
)
from vision_s2r.hardware.config import HardwareConfig, check
from vision_s2r.hardware.machines import MachineRecordings, machines
from vision_s2r.hardware.sensors import sensor_table
from vision_s2r.hardware.tables import (
    added_table,
    agreement_table,
    friction_table,
    identified_table,
    table,
    together_table,
)
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.progress import tracked
from vision_s2r.recording import CameraRecording, JointRecording, read, split
from vision_s2r.recording.joined import read_together
from vision_s2r.report.reading import diagnosed, read_report, values

T = TypeVar("T")
IDENTIFIED, ADDED = "identified.json", "added.json"
LEAST_LOGS = 3  # episodes, of which one is left out


def study(cfg: HardwareConfig) -> list[Path]:
    """Measure what is not measured yet, and write the tables; returns them.

    Raises UserError for bad values, and folders without logs.
    """
    check(cfg)
    out = Path(cfg.out)
    found = machines(Path(cfg.path), out / "recordings")
    wanted = _wanted(found, cfg)
    for machine, motions in tracked(wanted, len(wanted), "recordings"):
        folder = out / "reports" / machine.name / folder_of(motions)
        if is_arm(machine):
            if cfg.diagnose:
                diagnose_arm_of(machine, motions, folder, cfg.jobs)
            continue
        recording = read(machine.recordings[motions[0]])
        if isinstance(recording, CameraRecording):
            if cfg.diagnose:
                _diagnose_camera(recording, folder, cfg)
            continue
        if not cfg.diagnose:
            if not (folder / IDENTIFIED).exists():
                _write(folder / IDENTIFIED, _identified(machine, motions[0]))
            continue
        if not (folder / "measured.json").exists():
            _write(folder / "measured.json", _measured(machine, motions, folder, cfg.jobs))
        if len(machine.recordings) == 1 and not (folder / "left_out.json").exists():
            _write(folder / "left_out.json", _left_out(machine.recordings[motions[0]], folder, cfg.jobs))
        if cfg.added:
            together = _together(machine, motions)
            _measure_added(added.with_effects(together, read_report(folder / REPORT)), folder, cfg.jobs)
    return _tables(found, out)


def _wanted(found: list[MachineRecordings], cfg: HardwareConfig) -> list[tuple[MachineRecordings, tuple[str, ...]]]:
    """Machines, and the motions to diagnose: each alone, or those together that the configuration has."""
    wanted = []
    for machine in found:
        alone = [(motion,) for motion in machine.recordings]
        together = [tuple(cfg.together)] if set(cfg.together) <= machine.recordings.keys() else []
        for motions in together if cfg.together else alone:
            if not cfg.only or any(each in f"{machine.name}/{'+'.join(motions)}" for each in cfg.only):
                wanted.append((machine, motions))
    if cfg.together and not wanted:
        known = sorted({motion for machine in found for motion in machine.recordings})
        raise UserError(f"together: no machine has all of {', '.join(cfg.together)}; there are {', '.join(known)}")
    return wanted


def _tables(found: list[MachineRecordings], out: Path) -> list[Path]:
    experts = {machine.name: machine.expert for machine in found}
    files = sorted(each for each in out.glob("reports/**/measured.json"))
    done = {each.parent: measured for each in files if (measured := _read(each))["machine"] in experts}
    tables: dict[str, Any] = {"sensors": sensor_table(found)}
    alone = [each for each in done.values() if len(each["motions"]) == 1]
    together = [each for each in done.values() if len(each["motions"]) > 1]
    tables |= {"hardware": table(alone, experts)} if alone else {}
    tables |= {"together": together_table(together, alone)} if together else {}
    if identified := [_read(each) for each in sorted(out.glob(f"reports/**/{IDENTIFIED}"))]:
        of_these = [each for each in identified if each["machine"] in experts]
        tables |= {"identified": identified_table(of_these), "agreement": agreement_table(of_these)}
    arms = [
        each for machine in found if is_arm(machine) for each in measured_arms(machine, out / "reports" / machine.name)
    ]
    tables |= {"arms": arm_table(arms)} if arms else {}
    with_effects = {
        f"{machine.name}, {' and '.join(motions)}": [_read(file) for file in sorted(folder.glob(f"added/*/{ADDED}"))]
        for machine in found
        for motions, folder in diagnosed_motions(machine, out / "reports" / machine.name).items()
    }
    tables |= {"added": added_table(with_effects)} if any(with_effects.values()) else {}
    for folder, measured in done.items():
        if (folder / "left_out.json").exists() and (errors := _read(folder / "left_out.json")):
            tables[Path(measured["machine"]).name] = friction_table(measured, errors)
    return [
        write(out / f"{name}.json", json.dumps(content, indent=1, ensure_ascii=False) + "\n")
        for name, content in tables.items()
    ]


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def _write(path: Path, content: dict[str, Any]) -> None:
    write(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def _measured(machine: MachineRecordings, motions: Sequence[str], folder: Path, jobs: int) -> dict[str, Any]:
    """The diagnosis of one recording, or of several together, and errors on the others."""
    recording = _together(machine, motions)
    started = time.process_time()
    diagnosis = diagnose(recording, DiagnoseConfig(), jobs)
    seconds = time.process_time() - started
    report = diagnosis.to_dict()
    diagnosis.save(folder)
    simulators: dict[str, Values] = {
        "believed": {},
        "identified": diagnosis.settled.found.refitted.hypothesis.values,
        "diagnosed": values(diagnosed(report)),
    }
    others = {name: read(each) for name, each in machine.recordings.items() if name not in motions}
    return {
        "machine": machine.name,
        "motions": list(motions),
        "rows": int(recording.lengths.sum()),
        "verdict": report["verdict"],
        "effects": [{key: each[key] for key in ("name", "share", "ci", "parameters")} for each in report["effects"]],
        "refitted": [each["name"] for each in report["refitted"]],
        "gap": report["gap"],
        "others": {
            name: {key: _error(other, given) for key, given in simulators.items()}
            for name, other in others.items()
            if isinstance(other, JointRecording)
        },
        "seconds": seconds,
    }


def _together(machine: MachineRecordings, motions: Sequence[str]) -> JointRecording:
    recording = read_together([machine.recordings[motion] for motion in motions])
    assert isinstance(recording, JointRecording)
    return recording


def _identified(machine: MachineRecordings, motion: str) -> dict[str, Any]:
    """The nominal values that one recording asks for, and errors on all."""
    recordings = {
        name: each for name, path in machine.recordings.items() if isinstance(each := read(path), JointRecording)
    }
    started = time.process_time()
    case = JointCase(recordings[motion], {effect.name: effect for effect in JOINT_EFFECTS})
    found = case.fit(case.refitted | frozenset(case.certain), range(case.segments), NOMINAL)
    intervals, elsewhere = case.intervals(found), case.intervals_elsewhere(found)
    return {
        "machine": machine.name,
        "motion": motion,
        "parameters": {
            name: {
                key: {"value": value, "ci": intervals[name][key], "elsewhere": elsewhere[name][key]}
                for key, value in each.items()
            }
            for name, each in found.values.items()
        },
        "errors": {
            name: {"believed": _error(each, {}), "identified": _error(each, found.values)}
            for name, each in recordings.items()
        },
        "seconds": time.process_time() - started,
    }


def _diagnose_camera(recording: CameraRecording, folder: Path, cfg: HardwareConfig) -> None:
    """The diagnosis of pictures, unless it stands there; and again with effects added, where that is asked for."""
    if not (folder / REPORT).exists():
        diagnose(recording, DiagnoseConfig(), cfg.jobs).save(folder)
    if cfg.added and recording.pairing == "paired":
        _measure_added(added_pictures.with_effects(recording, read_report(folder / REPORT)), folder, cfg.jobs)


def _measure_added(with_effects: Iterable[added.Added], folder: Path, jobs: int) -> None:
    """A recording with each effect that can be added to it, diagnosed below its `folder` unless that is done."""
    without = read_report(folder / REPORT)
    for each in with_effects:
        out = folder / "added" / each.effect
        if not (out / ADDED).exists():
            diagnosis = diagnose(each.recording, DiagnoseConfig(), jobs)
            diagnosis.save(out)
            _write(out / ADDED, added.measured(each, diagnosis.to_dict(), without))


def _error(recording: JointRecording, given: Values) -> float:
    """Mean absolute error of the gap's quantity in free run."""
    return float(np.nanmean(np.sqrt(gap_errors(recording, free_run(recording, given)))))


def _left_out(folder: Path, report: Path, jobs: int) -> dict[str, dict[str, Any]]:
    """Each log left out in turn: under friction models fitted to the others, and under a diagnosis of the others.

    Empty for a recording of fewer than LEAST_LOGS.
    """
    recording = read(folder)
    if not isinstance(recording, JointRecording) or len(recording) < LEAST_LOGS:
        return {}
    whole = values(diagnosed(read_report(report / "report.json")))

    def rediagnosed(given: JointRecording) -> Values:
        return whole if given is recording else values(diagnosed(diagnose(given, DiagnoseConfig(), jobs).to_dict()))

    return {
        "as believed": _each_without(recording, lambda _: {}, _error),
        **{model: _each_without(recording, partial(bam.fit, model), bam.error) for model in bam.MODELS},
        "diagnosed": _each_without(recording, rediagnosed, _error),
    }


def _each_without(
    recording: JointRecording, fitted: Callable[[JointRecording], T], error: Callable[[JointRecording, T], float]
) -> dict[str, Any]:
    """Errors of each log under what is fitted to the others, and under what is to all; and seconds of the former."""
    started = time.process_time()
    episodes = range(len(recording))
    logs = [split(recording, [k]) for k in episodes]
    errors = [
        error(log, fitted(split(recording, [each for each in episodes if each != k]))) for k, log in enumerate(logs)
    ]
    seconds, whole = time.process_time() - started, fitted(recording)
    return {"errors": errors, "all": [error(log, whole) for log in logs], "seconds": seconds}
