"""Real tosses of a cube (ContactNets): diagnosed on some, and the error in windows on others, before and after.

    python -m vision_s2r.diagnose.tosses FILE.npz OUT

writes OUT/report.json of the diagnosed tosses, OUT/tosses.json, a table of errors on tosses that took no part, beside
those at the published coefficients, and OUT/tosses.png, one of these tosses. OUT/groups.json has what each 24 of all
tosses alone would say.
"""

import itertools
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose
from vision_s2r.files import write, write_figure
from vision_s2r.fit.case import Values
from vision_s2r.fit.contact.free_run import WINDOW, windowed
from vision_s2r.progress import tracked
from vision_s2r.recording import ContactRecording, split
from vision_s2r.recording.contactnets import read_contactnets
from vision_s2r.report.drawing import series
from vision_s2r.report.reading import diagnosed, values
from vision_s2r.statistics import Estimate, agree, interval

BELIEVED = {"lateral_friction": 0.5, "restitution": 0.5}  # of the simulator to be diagnosed
PUBLISHED: Values = {"lateral_friction": {"value": 0.18}, "restitution": {"value": 0.125}}
COMMAND = "python -m vision_s2r.diagnose.tosses cube_tosses.npz OUT"
FITTED, HELD = range(24), range(24, 144)  # tosses


def study(path: Path | str, out: Path | str) -> dict[str, Any]:
    """What `python -m vision_s2r.diagnose.tosses` writes; returns the table."""
    out = Path(out)
    tosses = read_contactnets(path, **BELIEVED)
    report = diagnose(split(tosses, FITTED), DiagnoseConfig()).to_dict()
    found = values(diagnosed(report))
    held = split(tosses, HELD)
    rows: list[list[Any]] = []
    for title, effects in (("as believed", {}), ("published", PUBLISHED), ("diagnosed", found)):
        position, angle = _errors(held, effects)
        rows.append([title, _text(effects), _interval(position, 1e3), _interval(angle, 180 / np.pi)])
    table = {
        "command": COMMAND,
        "source": f"{len(FITTED)} tosses diagnosed, {len(HELD)} others measured, in windows of {WINDOW:g} s",
        "columns": ["simulator", "its values", "position, mm", "attitude, °"],
        "rows": rows,
        "verdict": report["verdict"],
    }
    write(out / "report.json", json.dumps(report, indent=1) + "\n")
    write(out / "tosses.json", json.dumps(table, indent=1, ensure_ascii=False) + "\n")
    write(out / "groups.json", json.dumps(groups(tosses, report), indent=1, ensure_ascii=False) + "\n")
    _draw(held, found, out / "tosses.png")
    return table


def groups(tosses: ContactRecording, report: dict[str, Any]) -> dict[str, Any]:
    """What each of as many tosses as are diagnosed, alone, says of every parameter, and whether they agree: a table.

    `report`: of the first group.
    """
    size = len(FITTED)
    firsts = range(0, len(tosses) - size + 1, size)
    found: dict[str, list[Estimate]] = {}
    for first in tracked(firsts, len(firsts), "groups of tosses"):
        group = split(tosses, range(first, first + size))
        of_group = diagnose(group, DiagnoseConfig()).to_dict() if first else report
        for effect in of_group["effects"]:
            for key, each in effect["parameters"].items():
                name = effect["name"].replace("_", " ") + (f", {key}" if len(effect["parameters"]) > 1 else "")
                found.setdefault(name, []).append(Estimate(each["value"], *each["ci"]))
    return {
        "command": COMMAND,
        "source": f"{len(firsts)} groups of {size} tosses, each diagnosed alone; two agree where their values are no "
        "further apart than their 95 % intervals reach towards each other (root of the sum of squares)",
        "columns": ["named", "groups", "values: median (least to most)", "pairs that agree"],
        "rows": [[name, len(each), _range(each), _agreed(each)] for name, each in found.items()],
    }


def _range(found: Sequence[Estimate]) -> str:
    values = [each.value for each in found]
    return f"{np.median(values):.3g} ({min(values):.3g} to {max(values):.3g})"


def _agreed(found: Sequence[Estimate]) -> str:
    pairs = [agree(*pair) for pair in itertools.combinations(found, 2)]
    return f"{sum(pairs)} of {len(pairs)}"


def _errors(recording: ContactRecording, effects: Values) -> tuple[np.ndarray, np.ndarray]:
    """Mean square of the distance (m²) and of the angle (rad²) of each toss."""
    run = windowed(recording, effects)
    distance = np.sum((run.position - recording.position) ** 2, axis=-1)
    return np.nanmean(distance, axis=1), np.nanmean(run.angle**2, axis=1)


def _interval(squares: np.ndarray, unit: float) -> dict[str, Any]:
    """Root mean square over tosses, in another unit, and its 95 % interval, by bootstrap over them."""

    def roots(counts: np.ndarray) -> np.ndarray:
        return unit * np.sqrt(counts @ squares / counts.sum(axis=1))

    low, high = interval(roots, len(squares), 0)
    value = float(roots(np.ones((1, len(squares))))[0])
    return {"value": round(value, 2), "low": round(low, 2), "high": round(high, 2), "unit": "", "of": len(squares)}


def _text(effects: Values) -> str:
    """The values of effects, for people."""
    named = {name: {"value": value} for name, value in BELIEVED.items()} | dict(effects)
    parts = []
    for name, given in named.items():
        values = ", ".join(f"{value:.3g}" for value in given.values())
        parts.append(f"{name} {values}")
    return "; ".join(parts)


def _draw(recording: ContactRecording, effects: Values, path: Path) -> None:
    """The first toss: measured, as believed, and as diagnosed."""
    one = split(recording, [0])
    before, after = windowed(one, {}), windowed(one, effects)
    panels = {
        f"{axis}, m": {
            "measured": one.position[0, :, k],
            "before": before.position[0, :, k],
            "after": after.position[0, :, k],
        }
        for k, axis in enumerate("xyz")
    }
    write_figure(path, series(np.arange(one.position.shape[1]) * one.sample_time, panels), dpi=150)


if __name__ == "__main__":
    print(json.dumps(study(*sys.argv[1:3]), indent=1, ensure_ascii=False))
