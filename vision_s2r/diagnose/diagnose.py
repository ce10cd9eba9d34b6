"""From recordings to reports."""

import json
import logging
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias, overload

import numpy as np

from vision_s2r import parallel
from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.config import DiagnoseConfig, check
from vision_s2r.diagnose.quick import part_of, quickly
from vision_s2r.diagnose.report import OPEN, report
from vision_s2r.diagnose.search import Search
from vision_s2r.diagnose.settle import settle
from vision_s2r.diagnose.settled import Settled
from vision_s2r.effects import E
from vision_s2r.errors import UserError, nearest
from vision_s2r.files import whole_folder, write
from vision_s2r.fit.case import NOMINAL, Case, Experiment
from vision_s2r.lazy import load
from vision_s2r.patch.patch import write_patch
from vision_s2r.progress import tracked
from vision_s2r.recording import ArmRecording, CameraRecording, ContactRecording, JointRecording, Recording, read, table
from vision_s2r.recording.folders import folders, outputs
from vision_s2r.recording.joined import read_together
from vision_s2r.recording.robot import is_robot, read_robot
from vision_s2r.report import GapReport, figures, write_html
from vision_s2r.report.drawing import Figures, png
from vision_s2r.report.page import framed, html
from vision_s2r.report.reading import library

NEXT, NEXT_TARGET = "next_recording.csv", "next_recording.png"
log = logging.getLogger(__name__)

OfOneCase: TypeAlias = JointRecording | CameraRecording | ContactRecording  # an arm is of several


@dataclass(frozen=True, kw_only=True)
class SavedDiagnosis(GapReport):
    """A report that knows its recording, and can be saved with figures and a patch."""

    recording: Recording = field(repr=False)
    experiment: Experiment = field(repr=False)  # to record next

    @property
    def patched(self) -> bool:
        """Whether the simulator has anything that it had not."""
        raise NotImplementedError

    def plot(self) -> Figures:
        """Figures by caption."""
        raise NotImplementedError

    def save(self, folder: Path | str) -> Path:
        """Write report.json, report.html, looks.png, patch/ and next_recording.csv, the commands to run next.

        Of a camera next_recording.png is what to print and photograph, the table its poses. looks.png is the page's
        first figure: what was recorded beside both simulators. The folder is whole or not there at all; returns the
        page's path.

        What was in the folder is gone. Raises UserError where it cannot be written.
        """
        folder, report = Path(folder), self.to_dict()
        with whole_folder(folder, replace=True) as making:
            write(making / "report.json", json.dumps(report, indent=1, allow_nan=False))
            drawn = self.plot()
            write_html(report, drawn, making / "report.html")
            if drawn:
                write(making / "looks.png", png(next(iter(drawn.values()))))
            write_next(self.experiment, making)
            if self.patched:  # else the simulator stays as it came
                write_patch(report, self.recording, making / "patch")
        return folder / "report.html"

    def _repr_html_(self) -> str:
        return framed(html(self.to_dict(), self.plot()))


def write_next(experiment: Experiment, folder: Path) -> None:
    """Write next_recording.csv or .png into `folder`: what a person can run or print, where there is anything."""
    if commands := experiment.commands:
        write(folder / NEXT, table.text(list(commands), np.column_stack(list(commands.values()))))
    if experiment.target is not None:
        import cv2  # which no other kind needs

        write(folder / NEXT_TARGET, cv2.imencode(".png", experiment.target)[1].tobytes())


@dataclass(frozen=True, kw_only=True)
class Diagnosis(SavedDiagnosis):
    """A report that knows what it was made from."""

    recording: OfOneCase = field(repr=False)
    case: Case = field(repr=False)
    settled: Settled = field(repr=False)

    @property
    def patched(self) -> bool:
        """Whether the simulator has anything that it had not."""
        return bool(self.settled.simulator.names)

    def plot(self) -> Figures:
        """Figures by caption: what it looks like, and where the gap lies before and after."""
        simulator = self.settled.simulator
        with self.case.session():
            before, after = (self.case.samples(each) for each in (NOMINAL, simulator.hypothesis))
        return figures(self.recording, simulator.hypothesis.values, before, after, self.case.unit)


@overload
def diagnose(recording: OfOneCase, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> Diagnosis: ...


@overload
def diagnose(recording: Recording, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> SavedDiagnosis: ...


def diagnose(recording: Recording, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> SavedDiagnosis:
    """Diagnose one recording with `jobs` threads.

    Of `cfg`, recording, out and jobs are of `diagnose_all`. Raises
    UserError where the recording is too short to hold anything out, or cfg withholds an unknown effect.
    """
    cfg = cfg or DiagnoseConfig()
    if isinstance(recording, ArmRecording):
        of_arm: SavedDiagnosis = load("vision_s2r.diagnose.arm:diagnose_arm")(recording, cfg, jobs)  # imports MuJoCo
        return replace(of_arm, quick=True) if cfg.quick else of_arm
    recording = part_of(recording) if cfg.quick else recording
    case: Any = open_case(recording, cfg.withhold, jobs)
    limits = {"joint": cfg.joint, "contact": cfg.contact}.get(case.kind, cfg.camera)
    limits = quickly(limits) if cfg.quick else limits
    assessor = Assessor(case, limits, jobs, cfg.seed)
    with case.session():
        found = Search(case, assessor).run()
        if isinstance(recording, JointRecording) and (quieter := case.quieter(found.final.hypothesis)):
            case, assessor = quieter, Assessor(quieter, limits, jobs, cfg.seed)
            found = Search(case, assessor).run()
        settled = settle(case, assessor, found)
        if isinstance(recording, CameraRecording) and recording.pairing == "paired":
            settled = settled.at(case.finer(settled.simulator.hypothesis))
        written, experiment = report(case, assessor, settled)
    written |= {"quick": True} if cfg.quick else {}
    if isinstance(recording, JointRecording):
        written |= {"held_out": _held_out(recording, case, assessor, settled), "left_out": recording.left_out}
        if written["verdict"] in OPEN:
            written["unexplained"]["resembles"] += case.symptoms(settled.simulator.hypothesis)
    if isinstance(recording, CameraRecording) and recording.pairing == "paired":
        with case.session():
            written |= {"light": case.light(settled.simulator.hypothesis)}
    if isinstance(recording, CameraRecording) and recording.label_names:
        written |= {"effects": _by_name(written["effects"], recording.label_names)}
    if isinstance(recording, CameraRecording) and cfg.sensitivity:
        written |= {"policy": load("vision_s2r.diagnose.worth:worth")(written["effects"], cfg.sensitivity, cfg.policy)}
    return Diagnosis.of(written, recording=recording, experiment=experiment, case=case, settled=settled)


def _by_name(effects: Sequence[dict[str, Any]], names: Mapping[int, str]) -> list[dict[str, Any]]:
    """Effects with what the recording calls their labels."""
    return [each | ({"label_name": names[each["label"]]} if each.get("label") in names else {}) for each in effects]


def _held_out(recording: JointRecording, case: Any, assessor: Assessor, settled: Settled) -> dict[str, Any]:
    """What a replay of this very recording needs to see it as the report did: held out."""
    rows = case.rows(range(case.segments))
    fold = {segment: k for k, held in enumerate(assessor.folds) for segment in held}
    return {
        "recording": load("vision_s2r.fit.joint.free_run:fingerprint")(recording),
        "segments": [[recording.episodes[e], first, end, fold[k]] for k, (e, first, end) in enumerate(rows)],
        "folds": [each.values for each in settled.simulator.folds],
    }


def open_case(recording: OfOneCase, withhold: Collection[str] = (), jobs: int = 1) -> Case:
    """A recording beside its simulator, which does not know the withheld effects; no other kind is imported.

    `jobs`: threads that a first look at a joint may take.
    """
    if isinstance(recording, JointRecording):
        opened = partial(load("vision_s2r.fit.joint.case:JointCase"), jobs=jobs)
    elif isinstance(recording, ContactRecording):
        opened = load("vision_s2r.fit.contact.case:ContactCase")
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

    One recording, or several together, is worked on by `cfg.jobs` threads and lands in `cfg.out`; of several, as many
    at a time, each lands in a folder of `cfg.out` with its name.
    """
    check(cfg)
    given = folders(cfg.recording)
    if cfg.together:
        return [diagnose(read_together(given), cfg, cfg.jobs).save(cfg.out)]
    outs = outputs(cfg.out, given)
    processes, threads = (cfg.jobs, 1) if len(given) > 1 else (1, cfg.jobs)
    calls = ((*each, cfg, threads) for each in zip(given, outs, strict=True))
    done = parallel.run(_diagnose_into, calls, processes, cfg.backend)
    return list(tracked(done, len(given), "recordings"))


def _diagnose_into(folder: Path, out: Path, cfg: DiagnoseConfig, jobs: int) -> Path:
    if is_robot(folder):
        of_robot = load("vision_s2r.diagnose.robot:diagnose_robot")
        saved: Path = of_robot(read_robot(folder), cfg, jobs).save(out)
        return saved
    return diagnose(read(folder), cfg, jobs).save(out)
