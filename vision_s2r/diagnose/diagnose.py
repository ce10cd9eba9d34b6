"""From recordings to reports."""

import json
import logging
import os
import shutil
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib

from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.config import DiagnoseConfig, check
from vision_s2r.diagnose.report import report
from vision_s2r.diagnose.search import Found, Search
from vision_s2r.effects import E
from vision_s2r.errors import UserError, nearest
from vision_s2r.fit.case import Case
from vision_s2r.lazy import load
from vision_s2r.patch.patch import write_patch
from vision_s2r.progress import tracked
from vision_s2r.recording import ContactRecording, JointRecording, Recording, read
from vision_s2r.recording.folders import folders, outputs
from vision_s2r.report import figures, write_html
from vision_s2r.report.reading import library

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Diagnosis:
    """A report, and what it was made from."""

    recording: Recording
    case: Case
    found: Found
    report: dict[str, Any]


def diagnose(recording: Recording, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> Diagnosis:
    """Diagnose one recording with `jobs` threads.

    Raises UserError where the recording is too short to hold anything out, or cfg withholds an unknown effect.
    """
    cfg = cfg or DiagnoseConfig()
    case = open_case(recording, cfg.withhold)
    limits = cfg.joint if case.kind == "joint" else cfg.camera
    assessor = Assessor(case, limits, jobs, cfg.seed)
    with case.session():
        found = Search(case, assessor).run()
        return Diagnosis(recording, case, found, report(case, assessor, found))


def open_case(recording: Recording, withhold: Collection[str] = ()) -> Case:
    """A recording beside its simulator, which does not know the withheld effects; no other kind is imported."""
    if isinstance(recording, JointRecording):
        opened = load("vision_s2r.fit.joint.case:JointCase")
    elif isinstance(recording, ContactRecording):
        raise UserError("recordings of kind contact are read, but not yet diagnosed by this version")
    else:
        place = "unpaired.case:UnpairedCase" if recording.pairing == "unpaired" else "camera.case:CameraCase"
        opened = load(f"vision_s2r.fit.{place}").open
    case: Case = opened(recording, _library(library(recording.kind), withhold))
    return case


def _library(effects: Iterable[E], withhold: Collection[str]) -> dict[str, E]:
    library = {effect.name: effect for effect in effects}
    for name in withhold:
        if name not in library:
            raise UserError(f"withhold: no effect is called '{name}': {nearest(name, library)}")
    return {name: effect for name, effect in library.items() if name not in withhold}


def diagnose_all(cfg: DiagnoseConfig) -> list[Path]:
    """Diagnose the recordings of cfg, each into its folder; returns the reports (HTML).

    One recording is worked on by `cfg.jobs` threads and lands in `cfg.out`; of several, as many at a time, each lands
    in a folder of `cfg.out` with its name.
    """
    check(cfg)
    given = folders(cfg.recording)
    outs = outputs(cfg.out, given)
    processes, threads = (cfg.jobs, 1) if len(given) > 1 else (1, cfg.jobs)
    parallel = joblib.Parallel(processes, return_as="generator")
    calls = (joblib.delayed(_diagnose_into)(*each, cfg, threads) for each in zip(given, outs, strict=True))
    return list(tracked(parallel(calls), len(given), "recordings"))


def _diagnose_into(folder: Path, out: Path, cfg: DiagnoseConfig, jobs: int) -> Path:
    """Everything about one recording, in a folder that is complete or not there."""
    diagnosis = diagnose(read(folder), cfg, jobs)
    making = out.with_name(f"{out.name}.part-{os.getpid()}")
    shutil.rmtree(making, ignore_errors=True)
    making.mkdir(parents=True)
    try:
        (making / "report.json").write_text(json.dumps(diagnosis.report, indent=1, allow_nan=False))
        write_html(diagnosis.report, _figures(diagnosis), making / "report.html")
        write_patch(diagnosis.report, diagnosis.recording, making / "patch")
        shutil.rmtree(out, ignore_errors=True)
        making.rename(out)
    finally:
        shutil.rmtree(making, ignore_errors=True)
    return out / "report.html"


def _figures(diagnosis: Diagnosis) -> dict[str, bytes]:
    """The figures of a report: what it looks like, and where the gap lies before and after."""
    case, found = diagnosis.case, diagnosis.found
    with case.session():
        before, after = (case.samples(each.hypothesis) for each in (found.nominal, found.final))
    named = {name: found.final.hypothesis.values[name] for name in found.effects}
    return figures(diagnosis.recording, named, before, after, case.unit)
