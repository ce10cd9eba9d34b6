"""BAM's pendulum logs (github.com/Rhoban/bam): JSON files of one servo that swings a mass."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.imports.drives import DRIVES
from vision_s2r.imports.table import ImportOptions, JointTable
from vision_s2r.recording.header import number

GRAVITY = 9.80665  # m/s²
LARGEST = 1e6  # of a mass (kg), length (m), gain or voltage


def load(path: Path, options: ImportOptions) -> list[JointTable]:
    """All logs of a folder as episodes of one recording, or one file's. Raises UserError where there is none."""
    files = sorted(path.glob("*.json")) if path.is_dir() else [path]
    if not files:
        raise UserError(f"{path}: no .json in it, expected BAM's logs")
    logs = [_log(file) for file in files]
    bench = {key: logs[0][key] for key in ("mass", "arm_mass", "length", "vin", "motor")}
    gain = min(log["kp"] for log in logs)
    for file, log in zip(files, logs, strict=True):
        if any(log[key] != bench[key] for key in bench):
            words = "motor, supply, mass or length"
            raise UserError(f"{file}: another {words} than {files[0].name}, expected one bench")
    parts = [_columns(log, k, file) for k, (log, file) in enumerate(zip(logs, files, strict=True))]
    if gain > 0 and any(log["kp"] != gain for log in logs):
        for log, part in zip(logs, parts, strict=True):
            part["gain"] = np.full(len(part["t"]), log["kp"] / gain)
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    drive = bench["motor"] if bench["motor"] in DRIVES else ""
    swung = (bench["mass"] + bench["arm_mass"] / 3) * bench["length"] ** 2  # at the end of a uniform rod
    nominal = {"gravity_torque": (bench["mass"] + bench["arm_mass"] / 2) * GRAVITY * bench["length"]}
    control = {}
    if drive:
        known = DRIVES[drive]
        supply = bench["vin"] / known.volts if known.volts else 1.0  # gain and limit are of pulse widths
        nominal["inertia"] = known.nominal["inertia"] + swung
        control["limit"] = known.control["limit"] * supply
        control["proportional"] = known.control["proportional"] * supply * gain / known.firmware_gain
    left_out = {"load": "a register of the pulse width, no torque", "temp": "not modelled"}
    return [JointTable(path.stem, columns, drive, nominal, control, left_out)]


def _log(file: Path) -> dict[str, Any]:
    try:
        log = {"arm_mass": 0.0} | json.loads(file.read_text())
        bench = {key: number(log, key, str(file), 0.0, LARGEST) for key in ("mass", "arm_mass", "length", "kp", "vin")}
        return {**log, **bench, "motor": str(log["motor"])}
    except OSError as error:
        raise UserError(f"{file}: cannot be read ({error.strerror})") from error
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise _wrong(file, error) from error


def _wrong(file: Path, error: Exception) -> UserError:
    reason = str(error).splitlines()[0]
    return UserError(f"{file}: {reason} is wrong or missing, expected a log as BAM writes it")


def _columns(log: dict[str, Any], episode: int, file: Path) -> dict[str, np.ndarray]:
    names = {"target": "goal_position", "position": "position", "velocity": "speed", "enabled": "torque_enable"}
    names |= {"t": "timestamp", "supply": "input_volts"}
    try:
        rows = {ours: np.array([float(entry[name]) for entry in log["entries"]]) for ours, name in names.items()}
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise _wrong(file, error) from error
    if not len(rows["t"]):
        raise UserError(f"{file}: entries are empty, expected one a sample")
    later = np.r_[True, np.diff(rows["t"]) > 0]
    columns = {"episode": np.full(int(later.sum()), float(episode))} | {ours: v[later] for ours, v in rows.items()}
    return columns | {"t": columns["t"] - rows["t"][0], "supply": columns["supply"] / log["vin"]}
