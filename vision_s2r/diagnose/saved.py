"""A report that can be saved, with figures, a patch, and what to record next."""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vision_s2r.files import whole_folder, write
from vision_s2r.fit.case import Experiment
from vision_s2r.patch.patch import write_patch
from vision_s2r.recording import Recording, table
from vision_s2r.report import GapReport, write_html
from vision_s2r.report.drawing import Figures, png
from vision_s2r.report.page import framed, html

NEXT, NEXT_TARGET = "next_recording.csv", "next_recording.png"


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
