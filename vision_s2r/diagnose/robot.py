"""A whole machine: each of its parts diagnosed with real inputs against real outputs, and one report over all.

No part is driven by what another part's simulator makes, so that errors of one do not pile up in the next.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.one_case import Diagnosis, diagnose_one
from vision_s2r.files import whole_folder, write
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.recording.robot import RobotRecording
from vision_s2r.report.reading import FORMAT
from vision_s2r.report.robot import html
from vision_s2r.statistics import interval_of_groups, wilson

TINY = 1e-300
DESCRIBED = (
    "squared gap of each part in units of its own measurement noise; what a part's gap costs the task is not measured"
)


@dataclass(frozen=True)
class RobotDiagnosis:
    """The reports of a robot's parts, and one over all."""

    parts: Mapping[str, Diagnosis]  # by their folder in the robot's
    report: Mapping[str, Any]  # as report.json has it

    def save(self, folder: Path | str) -> Path:
        """Write report.json and report.html into a folder, and each part's report into one of its name in it.

        Whole or not at all; what was in the folder is gone. Returns the page's path. Raises UserError where it cannot
        be written.
        """
        folder = Path(folder)
        with whole_folder(folder, replace=True) as making:
            for name, part in self.parts.items():
                part.save(making / name)
            write(making / "report.json", json.dumps(self.report, indent=1, allow_nan=False))
            write(making / "report.html", html(self.report))
        return folder / "report.html"


def diagnose_robot(recording: RobotRecording, cfg: DiagnoseConfig | None = None, jobs: int = 1) -> RobotDiagnosis:
    """Diagnose every part of a robot, one after the other, each with `jobs` threads. Raises UserError as `diagnose`."""
    cfg = cfg or DiagnoseConfig()
    parts = {name: diagnose_one(part, cfg, jobs) for name, part in recording.parts.items()}
    return RobotDiagnosis(parts, _report(recording, parts, cfg.seed))


def _report(recording: RobotRecording, parts: Mapping[str, Diagnosis], seed: int) -> dict[str, Any]:
    shares = dict(zip(parts, _shares([part.settled.gap for part in parts.values()], seed), strict=True))
    effects = [{"part": name, **effect} for name, part in parts.items() for effect in part.to_dict()["effects"]]
    return {
        "format": FORMAT,
        "kind": recording.kind,
        "verdict": _verdict([part.verdict for part in parts.values()]),
        "described": DESCRIBED,
        "stages": [_stage(name, part, shares[name]) for name, part in parts.items()],
        "effects": effects,
        **({} if recording.success is None else {"task": _task(recording.success)}),
    }


def _stage(name: str, part: Diagnosis, share: Share) -> dict[str, Any]:
    report = part.to_dict()
    keys = ("kind", "verdict", "gap", "sources", "unexplained", "next_experiment")
    return {"part": name, "share": share.value, "ci": list(share.ci), **{key: report[key] for key in keys}}


def _shares(gaps: list[Gap], seed: int) -> list[Share]:
    """Each part's share of the sum of squared gaps, each less its floor and in units of it."""

    def share(k: int, counts: list[np.ndarray]) -> np.ndarray:
        over = [
            np.maximum(count @ (gap.before - gap.floor), 0) / np.maximum(count @ gap.floor, TINY)
            for count, gap in zip(counts, gaps, strict=True)
        ]
        return np.asarray(over[k] / np.maximum(sum(over), TINY))

    sizes = [len(gap.before) for gap in gaps]
    whole = [np.ones((1, size)) for size in sizes]
    return [
        Share(float(share(k, whole)[0]), interval_of_groups(partial(share, k), sizes, seed)) for k in range(len(gaps))
    ]


def _verdict(verdicts: list[str]) -> str:
    """Of the whole: explained where every part is, unexplained where no part with a gap is even in part."""
    gaps = [verdict for verdict in verdicts if verdict != "no_gap"]
    if not gaps:
        return "no_gap"
    if set(gaps) == {"explained"}:
        return "explained"
    return "unexplained" if set(gaps) == {"unexplained"} else "partly_explained"


def _task(success: np.ndarray) -> dict[str, Any]:
    rate = wilson(int(success.sum()), len(success))
    return {"episodes": len(success), "success": rate.value, "ci": [rate.low, rate.high]}
