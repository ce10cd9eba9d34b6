"""What was measured, as tables."""

from typing import Any

import rich.box
from rich.console import Console
from rich.table import Table

LABELS = {
    "analytic": "analytic motor",
    "paper": "network, t, t − 0.01, t − 0.02 s",
    "long": "network, longer history",
    "drive": "the drive itself",
}
DATA = {"validation": "held-out motions", "policy": "the policies' own motions"}
PAPER = {"validation": (3.55, 0.740), "policy": (5.74, 0.966)}  # N·m, Hwangbo et al. 2019: ideal actuator, network


def show(found: dict[str, Any]) -> None:
    """Print the tables of an actuator.json."""
    console = Console(highlight=False, width=120)
    for name, models in found["torque"].items():
        console.print(_torques(DATA[name], models, PAPER[name]))
    console.print(_transfer(found["transfer"], found["settings"]["task"]["tolerance"]))


def _torques(title: str, models: dict[str, Any], paper: tuple[float, float]) -> Table:
    table = _table(f"torque on {title}, N·m", "model", "mean |error|", "analytic / it", "RMS error", "analytic / it")
    for name, model in models.items():
        factors = ["" if name == "analytic" else interval(model[key], ".1f") for key in ("factor", "factor_rms")]
        row = f"{model['mean_absolute']:.4f}", factors[0], f"{model['rms']:.4f}", factors[1]
        table.add_row(LABELS[name], *row)
    table.add_row("in the paper", f"{paper[0]:g}, {paper[1]:g}", f"{paper[0] / paper[1]:.1f}", "", "")
    return table


def _transfer(rows: dict[str, Any], tolerance: float) -> Table:
    held = f"at most {100 * tolerance:g} % worse there, %"
    columns = "tuned with", "its error, mrad", "on the drive", "/ tuned on the drive"
    table = _table("controllers of the load's position", *columns, held)
    for name, row in rows.items():
        errors = f"{1e3 * row['own_error']:.1f}", f"{1e3 * row['drive_error']:.1f}"
        share = {key: 100 * value for key, value in row["transferred"].items()}
        judged = interval(row["over_tuned_on_drive"], ".2f"), f"{interval(share, '.0f')}, {row['count']} of {row['of']}"
        table.add_row(LABELS[name], *errors, *(("", "") if name == "drive" else judged))
    return table


def interval(estimate: dict[str, float], form: str) -> str:
    """A value with its 95 % interval."""
    return f"{estimate['value']:{form}} ({estimate['low']:{form}}–{estimate['high']:{form}})"


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=rich.box.SIMPLE, show_edge=False, pad_edge=False)
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k == 0 else "right", no_wrap=True)
    return table
