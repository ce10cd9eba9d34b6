"""From a source's tables to recordings."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vision_s2r.errors import UserError, nearest
from vision_s2r.files import whole_folder, write
from vision_s2r.imports import bag, bam, lerobot, sage, tabular
from vision_s2r.imports.drives import DRIVES, known_drive
from vision_s2r.imports.picture import picture
from vision_s2r.imports.table import ImportOptions, JointTable, read_back
from vision_s2r.recording import JointRecording
from vision_s2r.recording.header import FORMAT
from vision_s2r.recording.joint import COLUMNS
from vision_s2r.recording.table import text as table_text

SOURCES: dict[str, Callable[[Path, ImportOptions], list[JointTable]]] = {
    "sage": sage.load,
    "bam": bam.load,
    "lerobot": lerobot.load,
    "bag": bag.load,
    "csv": tabular.load,
}
LEAST_ROWS = 12  # that a speed can be read off


@dataclass(frozen=True)
class Imported:
    """One recording that was written."""

    folder: Path
    summary: dict[str, Any]  # what import.json holds

    def __str__(self) -> str:
        """A few lines for people."""
        s = self.summary
        if "joints" in s:
            lines = [f"{self.folder}: {s['rows']} rows, an arm", *(f"  {line}" for line in s["joints"])]
            return "\n".join(lines + [f"  left out: {line}" for line in s["left_out"]])
        lines = [
            f"{self.folder}: {s['rows']} rows, {s['episodes']} episodes, {s['seconds']:.1f} s at {s['rate']:.4g} Hz "
            f"(steps {1e3 * s['steps'][0]:.3g} to {1e3 * s['steps'][1]:.3g} ms)",
            f"  read: {', '.join(s['columns'])}; believed: {s['believed']}",
        ]
        lines += [f"  note: {note}" for note in s["notes"]]
        lines += [f"  left out: {name}, {why}" for name, why in s["left_out"].items()]
        lines += [f"  missing: {', '.join(s['missing'])}"] if s["missing"] else []
        return "\n".join(lines)


def import_recording(
    source: str, path: Path | str, out: Path | str, options: ImportOptions | None = None
) -> list[Imported]:
    """Write the joints of a log as recordings into folders of `out`, or `out` itself where there is only one.

    Raises UserError for a source that is not known, a log that is none, and where what the simulator believes is needed
    and neither known of the drive nor given.
    """
    if source not in SOURCES:
        raise UserError(f"no source is called '{source}': {nearest(source, SOURCES)}")
    options, path, out = options or ImportOptions(), Path(path), Path(out)
    if not path.exists():
        raise UserError(f"{path}: no such file or folder, expected a log of {source}")
    tables = SOURCES[source](path, options)
    for table in tables:
        if (rows := len(table.columns["t"])) < LEAST_ROWS:
            raise UserError(f"{path}: {table.name} has {rows} row{'s' * (rows != 1)}, expected a log of motion")
    if options.joint:
        names = [table.name.split("/")[-1] for table in tables]
        if options.joint not in names:
            raise UserError(f"{path}: no joint is called '{options.joint}', {nearest(options.joint, names)}")
        tables = [table for table, name in zip(tables, names, strict=True) if name == options.joint]
    if options.model:
        from vision_s2r.imports import arm  # imports MuJoCo

        return [Imported(*each) for each in arm.write_arms(tables, out, options)]
    return [_write(table, out / table.name if len(tables) > 1 else out, options) for table in tables]


def _write(table: JointTable, folder: Path, options: ImportOptions) -> Imported:
    head, believed = _header(table, options)
    columns = [name for name in COLUMNS if name in table.columns]
    rows = np.stack([table.columns[name] for name in columns], axis=1)
    rows = rows[np.isfinite(rows).all(axis=1)]
    with whole_folder(folder) as making:
        write(making / "joint.csv", table_text(columns, rows))
        write(making / "recording.yaml", yaml.safe_dump(head, sort_keys=False))
        recording = read_back(making, table.name)
        assert isinstance(recording, JointRecording)
        summary = _summary(table, recording, believed, len(table.columns["t"]) - len(rows))
        write(making / "import.json", json.dumps(summary, indent=1) + "\n")
        write(making / "import.png", picture(recording, table.columns))
    return Imported(folder, summary)


def _header(table: JointTable, options: ImportOptions) -> tuple[dict[str, Any], str]:
    """recording.yaml, and where its beliefs come from."""
    known = known_drive(options.drive or table.drive)
    nominal: dict[str, float] = {**known.nominal, **table.nominal, **options.nominal}
    head: dict[str, Any] = {"format": FORMAT, "kind": "joint", "units": table.units or options.units}
    same = np.diff(table.columns["episode"]) == 0
    head["sample_time"] = float(f"{np.median(np.diff(table.columns['t'])[same]):.9g}")
    head["nominal"] = nominal
    if "target" in table.columns:
        head["control"] = {**known.control, **table.control, **options.control}
    least = ["inertia", "viscous_damping", "coulomb_friction"] + ["torque_constant"] * ("current" in table.columns)
    lacking = [f"nominal.{name}" for name in least if name not in nominal]
    lacking += ["control.proportional"] if "control" in head and "proportional" not in head["control"] else []
    if lacking:
        raise UserError(f"{table.name}: {', '.join(lacking)} is not known, expected them, or drive={'|'.join(DRIVES)}")
    return head, known.source


def _summary(table: JointTable, recording: JointRecording, believed: str, dropped: int) -> dict[str, Any]:
    steps = np.concatenate([np.diff(t[:n]) for t, n in zip(recording.time, recording.lengths, strict=True)])
    left_out: Mapping[str, str] = {**table.left_out, **recording.left_out}
    if dropped:
        left_out = {**left_out, "rows": f"{dropped} with a value that is no number"}
    return {
        "rows": int(recording.lengths.sum()),
        "episodes": len(recording),
        "seconds": float(sum(t[n - 1] for t, n in zip(recording.time, recording.lengths, strict=True))),
        "rate": 1 / recording.sample_time,
        "steps": [float(steps.min()), float(steps.max())],
        "columns": [name for name in COLUMNS if name in table.columns and name not in left_out],
        "left_out": dict(left_out),
        "missing": list(table.missing),
        "notes": list(table.notes),
        "believed": believed,
        "nominal": recording.nominal,
    }
