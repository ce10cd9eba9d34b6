"""From recordings to reports."""

from dataclasses import replace
from pathlib import Path
from typing import overload

from vision_s2r import parallel
from vision_s2r.diagnose.config import DiagnoseConfig, check
from vision_s2r.diagnose.one_case import Diagnosis, OfOneCase, diagnose_one
from vision_s2r.diagnose.saved import SavedDiagnosis
from vision_s2r.errors import UserError
from vision_s2r.lazy import load
from vision_s2r.progress import tracked
from vision_s2r.recording import ArmRecording, Recording, read
from vision_s2r.recording.folders import folders, outputs
from vision_s2r.recording.joined import read_together
from vision_s2r.recording.robot import is_robot, read_robot


@overload
def diagnose(recording: OfOneCase, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> Diagnosis: ...


@overload
def diagnose(recording: Recording, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> SavedDiagnosis: ...


def diagnose(recording: Recording, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> SavedDiagnosis:
    """Diagnose one recording with `jobs` threads.

    Of `cfg`, recording, out and jobs are of `diagnose_all`. Raises UserError where the recording is too short to hold
    anything out, or cfg withholds an unknown effect, or asks for an arm's bounds.
    """
    cfg = cfg or DiagnoseConfig()
    if isinstance(recording, ArmRecording):
        if cfg.bounds:
            raise UserError("bounds: an arm's report has none, expected false")
        of_arm: SavedDiagnosis = load("vision_s2r.diagnose.arm:diagnose_arm")(recording, cfg, jobs)  # imports MuJoCo
        return replace(of_arm, quick=True) if cfg.quick else of_arm
    return diagnose_one(recording, cfg, jobs)


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
