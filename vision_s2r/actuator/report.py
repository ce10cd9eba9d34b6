"""What was measured, as tables: `columns` and `rows` of a results page, and on the terminal."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.table import Table

from vision_s2r.actuator.config import ActuatorConfig

LABELS = {
    "analytic": "analytic motor",
    "identified": "… its constants identified",
    "diagnosed": "… with the effects that a diagnosis named",
    "paper": "network, t, t − 0.01, t − 0.02 s",
    "long": "network, longer history",
    "drive": "the drive itself",
}
DATA = {"validation": "held-out motions", "policy": "the policies' own motions"}
PAPER = {"validation": (3.55, 0.740), "policy": (5.74, 0.966)}  # N·m, Hwangbo et al. 2019: ideal actuator, network


def tables(found: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """`actuator_error` and `actuator_control` of an actuator.json, `command`, `columns` and `rows` each."""
    settings = found["settings"]
    command = " ".join(["vision-s2r actuator", *_changed(settings, asdict(ActuatorConfig()))])
    return {
        "actuator_error": {"command": command, **_torques(found["torque"])},
        "actuator_control": {"command": command, **_transfer(found["transfer"], settings["task"]["tolerance"])},
    }


def _changed(given: Mapping[str, Any], usual: Mapping[str, Any], prefix: str = "") -> list[str]:
    """What a command line says for settings that are not as usual."""
    found = []
    for name, value in given.items():
        if isinstance(value, Mapping) and name in usual:
            found += _changed(value, usual[name], f"{prefix}{name}.")
        elif name != "out" and value != usual.get(name):
            found.append(f"{prefix}{name}={value}".replace(" ", ""))
    return found


def show(named: Mapping[str, Mapping[str, Any]]) -> None:
    """Print tables."""
    for each in named.values():
        table = Table(*each["columns"])
        for row in each["rows"]:
            table.add_row(*row)
        Console(width=160).print(table)


def _torques(torque: Mapping[str, Any]) -> dict[str, Any]:
    columns, rows = ["mean absolute torque error, N·m"], []
    for name in torque:
        columns += [DATA[name], "better than analytic; in RMS"]
    for model in next(iter(torque.values())):
        row = [LABELS[model]]
        for models in torque.values():
            factors = "; ".join(f"{interval(models[model][key], '.1f')} ×" for key in ("factor", "factor_rms"))
            row += [f"{models[model]['mean_absolute']:.4f}", "" if model == "analytic" else factors]
        rows.append(row)
    there = [
        f"{network:g} of {ideal:g}, {ideal / network:.1f} ×" for ideal, network in (PAPER[name] for name in torque)
    ]
    rows.append(["in the paper, another motor", *(cell for each in there for cell in each.split(", "))])
    return {"columns": columns, "rows": rows}


def _transfer(found: list[dict[str, Any]], tolerance: float) -> dict[str, Any]:
    held = f"at most {100 * tolerance:g} % worse than in training"
    columns = ["policies trained with", "min of log", "error there, mrad", "on the drive, mrad"]
    rows = []
    for row in found:
        errors = [f"{1e3 * row[key]:.1f}" for key in ("own_error", "drive_error")]
        judged = [interval(row["over_trained_on_drive"], ".2f"), f"{row['count']} of {row['of']}"]
        minutes = f"{row['minutes']:g}" if row["minutes"] else ""
        rows.append([LABELS[row["model"]], minutes, *errors, *(["", ""] if row["model"] == "drive" else judged)])
    return {"columns": [*columns, "over one trained on the drive", held], "rows": rows}


def interval(estimate: Mapping[str, float], form: str) -> str:
    """A value with its 95 % interval."""
    return f"{estimate['value']:{form}} ({estimate['low']:{form}}–{estimate['high']:{form}})"
