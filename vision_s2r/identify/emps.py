"""A real linear axis, identified both ways, beside what was published of it.

A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Nonlinear System Identification Benchmarks
workshop, 2019.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import rich.box
from rich.console import Console
from rich.table import Table
from scipy.stats import norm

from vision_s2r.files import write
from vision_s2r.identify.config import HoldConfig, IdentifyConfig, InverseConfig
from vision_s2r.identify.emps_mass import mass_table
from vision_s2r.identify.estimate import Label, ParameterEstimates
from vision_s2r.identify.identify import identify, torque_error
from vision_s2r.recording import JointRecording

Column: TypeAlias = dict[str, dict[str, float]]  # by row, its value, and half of its 95 % interval where that is known

MASS, VISCOUS, COULOMB = ("inertia", "value"), ("viscous_damping", "value"), ("coulomb_friction", "value")
OFFSET: Label = ("bias_torque", "value")
MORE_VISCOUS, MORE_COULOMB = ("asymmetric_friction", "viscous"), ("asymmetric_friction", "coulomb")
ERRORS = ("force error, %", "on the pulses, %")


@dataclass(frozen=True)
class Model:
    """A model of the axis: each of its parameters as a sum of ours, and what was published."""

    parameters: Mapping[str, Mapping[Label, float]]  # by name, our parameters with their weights
    published: Mapping[str, float]
    effects: list[str] = field(default_factory=list)
    hold: HoldConfig = field(default_factory=HoldConfig)


MODELS = {
    "symmetric friction": Model(
        parameters={"M, kg": {MASS: 1}, "Fv, N·s/m": {VISCOUS: 1}, "Fc, N": {COULOMB: 1}, "offset, N": {OFFSET: 1}},
        published={"M, kg": 95.1089, "Fv, N·s/m": 203.5034, "Fc, N": 20.3935, "offset, N": -3.1648}
        | dict(zip(ERRORS, (4.08, 5.98), strict=True)),
    ),
    "asymmetric friction": Model(
        parameters={
            "M, kg": {MASS: 1},
            "Fv+, N·s/m": {VISCOUS: 1, MORE_VISCOUS: 1},
            "Fc+, N": {COULOMB: 1, MORE_COULOMB: 1},
            "Fv−, N·s/m": {VISCOUS: 1, MORE_VISCOUS: -1},
            "Fc−, N": {COULOMB: 1, MORE_COULOMB: -1},
        },
        published={"Fv+, N·s/m": 166.71, "Fc+, N": 20.14, "Fv−, N·s/m": 240.42, "Fc−, N": 20.63}
        | dict(zip(ERRORS, (3.11, 5.34), strict=True)),
        effects=["asymmetric_friction"],
        hold=HoldConfig(bias_torque=0.0),  # in motion it is one with the asymmetry of Fc
    ),
}
# The authors take the force as it was sampled; recordings have it that commands are held between samples.
METHODS = {
    "inverse, as published": ("inverse", InverseConfig(held=False, reversals=True)),
    "inverse": ("inverse", InverseConfig()),
    "forward": ("forward", InverseConfig()),
}


def run(estimation: JointRecording, pulses: JointRecording, out: Path) -> Path:
    """Print the models side by side with what was published; returns the path of emps.json, the same as one table."""
    tables: dict[str, dict[str, Column]] = {}
    for name, model in MODELS.items():
        published = {row: {"value": value} for row, value in model.published.items()}
        tables[name] = {"published": published} | {
            column: compare(model, estimation, pulses, method, inverse) for column, (method, inverse) in METHODS.items()
        }
        Console().print(_table(name, [*model.parameters, *ERRORS], tables[name]))
    masses = mass_table({"estimation": estimation, "pulses": pulses})
    write(out / "emps_mass.json", json.dumps(masses, indent=1, ensure_ascii=False) + "\n")
    return write(out / "emps.json", json.dumps(_published(tables), indent=1, ensure_ascii=False) + "\n")


def _published(tables: Mapping[str, Mapping[str, Column]]) -> dict[str, Any]:
    """All models below each other, as the documentation's tables are."""
    names = ["published", *METHODS]
    rows: list[list[str]] = []
    for title, columns in tables.items():
        rows.append([f"**{title}**", *("" for _ in names)])
        rows += [
            [row, *(_cell(columns[name].get(row)) for name in names)] for row in (*MODELS[title].parameters, *ERRORS)
        ]
    return {"command": "vision-s2r identify example=emps recording=DIR", "columns": ["", *names], "rows": rows}


def compare(
    model: Model, estimation: JointRecording, pulses: JointRecording, method: str, inverse: InverseConfig
) -> Column:
    """The model's parameters from one recording, and its relative force errors (%) on it and on the other."""
    cfg = IdentifyConfig(effects=model.effects, hold=model.hold, method=method, inverse=inverse)
    found = identify(estimation, cfg)
    column = {row: _sum(found.estimate, weights) for row, weights in model.parameters.items()}
    for row, recording in zip(ERRORS, (estimation, pulses), strict=True):
        column[row] = {"value": 100 * torque_error(recording, found.values, inverse)["after"]}
    return column


def _sum(estimate: ParameterEstimates, weights: Mapping[Label, float]) -> dict[str, float]:
    weight = np.array([weights.get(label, 0.0) for label in estimate.labels])
    deviation = float(np.sqrt(weight @ estimate.covariance @ weight))
    return {"value": float(weight @ estimate.values), "reach": float(norm.ppf(0.975)) * deviation}


def _table(title: str, rows: list[str], columns: dict[str, Column]) -> Table:
    table = Table(title=title, box=rich.box.SIMPLE, show_edge=False, pad_edge=False, title_justify="left")
    table.add_column("", no_wrap=True)
    for name in columns:
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(row, *[_cell(column.get(row)) for column in columns.values()])
    return table


def _cell(figure: Mapping[str, float] | None) -> str:
    if figure is None:
        return "–"
    reach = f" ± {figure['reach']:.2f}" if "reach" in figure else ""
    return f"{figure['value']:.2f}{reach}".replace("-", "−")
