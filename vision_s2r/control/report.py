"""What was measured, as a table: `columns` and `rows` of a results page."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from vision_s2r.control.config import ControlConfig

CEILING = "ceiling"
TITLES = {
    "open loop": "open-loop inverse",
    "default": "PPO, the wrong simulator",
    "randomized": "PPO, b and τ_f randomized",
    "history": "… that sees 4 samples back",
    "window": "taught under every effect, 40 samples back",
    "memory": "taught under every effect, with a memory",
    CEILING: "knows the machine",
}
SPEED = 5.0  # rad/s, of the steady error


def follow(cfg: ControlConfig, found: Mapping[str, Any]) -> dict[str, Any]:
    """`command`, `columns` and `rows` of a follow.json; regret is the last policy's."""
    names = list(found["table"])
    last = names[-2]
    at = int(np.argmin(np.abs(np.array(found["speeds"]) - SPEED)))
    steady = [f"{_percent(np.mean(each, axis=0)[at])} %" for each in found["steady"].values()]
    drift = [f"{_percent(np.mean(each, axis=0)[-1])} %" for each in found["drift"].values()]
    rows: list[list[Any]] = [
        [f"reality: steady error at {SPEED:g} rad/s", *steady, "", ""],
        [f"after {cfg.drift.minutes:g} minutes in which b drifts to {cfg.drift.damping:g}: error", *drift, "", ""],
    ]
    for reality in found["table"][last]:
        cells = [_cell(row[reality]) for row in found["table"].values()]
        rows.append([reality.replace("_", " "), *cells, _share(found["table"][last][reality]["regret"])])
    only = f" only=[{','.join(cfg.only)}]" if cfg.only else ""
    return {
        "command": f"vision-s2r control follow{only} seed={cfg.seed} seeds={cfg.seeds}",
        "columns": ["targets reached, %; mean error", *(TITLES.get(name, name) for name in names), "regret"],
        "rows": rows,
    }


def adr(cfg: ControlConfig, found: Mapping[str, Any]) -> dict[str, Any]:
    """`command`, `columns` and `rows` of an adr.json."""
    names = list(found["table"])
    sets = list(found["table"][names[0]])
    rows: list[list[Any]] = [[each, *(_cell(row[each]) for row in found["table"].values())] for each in sets]
    covered = ", ".join(_percent(each[-1], ".0f") for each in found["coverage"])
    shares = {"automatic": covered, "hand-picked": _percent(found["hand_picked_coverage"], ".0f")}
    shares["afresh in its ranges"] = "the same"
    rows.append(["share of reality's box that the ranges cover, %", *(shares.get(name, "") for name in names)])
    return {
        "command": f"vision-s2r control adr seed={cfg.seed} seeds={cfg.seeds}",
        "columns": ["targets reached, %; mean error", *(TITLES.get(name, name) for name in names)],
        "rows": rows,
    }


def ablate(cfg: ControlConfig, table: Mapping[str, Any]) -> dict[str, Any]:
    """`command`, `columns` and `rows` of an ablate.json."""
    seeds, machines = cfg.ablation.seeds, cfg.ablation.machines
    return {
        "command": f"vision-s2r control ablate seed={cfg.seed} ablation.seeds={seeds} ablation.machines={machines}",
        "columns": ["trained with", "targets reached, %; mean error", "targets"],
        "rows": [[name, _cell(row), row["targets"]] for name, row in table.items()],
    }


def _cell(cell: Mapping[str, Any]) -> str:
    error = cell["error"]
    return f"{_share(cell['reached'])}; {_percent(error, '.0f' if error >= 0.1 else '.1f')} %"


def _share(estimate: Mapping[str, float]) -> str:
    low, high = (_percent(estimate[end], ".0f") for end in ("low", "high"))
    return f"{_percent(estimate['value'])} ({low}{' to ' if estimate['low'] < 0 else '–'}{high})"


def _percent(value: float, form: str = ".1f") -> str:
    text = format(100 * value, form)
    return (text[1:] if float(text) == 0 and text.startswith("-") else text).replace("-", "−")
