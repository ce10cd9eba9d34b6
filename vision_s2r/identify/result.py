"""What an identification leaves behind: a table to read, a JSON to go on with, pictures, a posterior, a patch.

`identified.json` holds `format`, `kind`, `method` (forward or inverse), and

effects         what to change in the simulator, as in a report: `name`, `source`, `parameters` with `value`, `unit` and
                `ci` (95 %); `nominal` where it replaces a nominal value, `held` where that was said to be known
unidentified    `name` and `why`: what the recording cannot identify; it stays as it was
doubtful        `name` and `why`: identified, but tied to another, or at the end of its range
correlation     `parameters` [K] and their `matrix` [K, K]
offsets         of each recording after the first of several: how much more its `bias_torque` and, where that was asked
                for, its `position_offset` are, and `ci`
gap             as in a report, held out; `refitted` is after the nominal parameters alone
torque_error    of the inverse method: relative, `before` and `after`
validation      the same on another recording, where one is given; `position_rmse` and `velocity_rmse` of a free run
next_experiment what to record to identify the rest; may be empty
"""

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import rich.box
from rich.console import Console
from rich.table import Table

from vision_s2r.files import write
from vision_s2r.identify.drawing import correlations
from vision_s2r.identify.estimate import title
from vision_s2r.joint import DYNAMICS, JOINT_EFFECTS, NominalJoint
from vision_s2r.patch.patch import write_patch
from vision_s2r.report import figures, words
from vision_s2r.report.drawing import Figures, png

if TYPE_CHECKING:
    from vision_s2r.identify.identified import Identified

FORMAT = "vision-s2r/identified/1"
PICTURES = ("before_after.png", "where.png")
CORRELATIONS = "How parameters are tied to each other: their correlations"
WIDTH = 120  # characters


def content(found: "Identified") -> dict[str, Any]:
    """What identified.json holds."""
    curable = {name for name, reason in {**found.left, **found.doubts}.items() if reason.curable}
    return {
        "format": FORMAT,
        "kind": "joint",
        "method": found.method,
        "effects": [
            _effect(found, name) for name in sorted(found.values, key=lambda name: (name not in DYNAMICS, name))
        ],
        "unidentified": [{"name": name, "why": reason.why} for name, reason in found.left.items()],
        "doubtful": [{"name": name, "why": reason.why} for name, reason in found.doubts.items()],
        "correlation": {
            "parameters": [title(label) for label in found.estimate.labels],
            "matrix": found.estimate.correlation.tolist(),
        },
        "gap": _gap(found),
        **found.errors,
        **({"offsets": offsets} if (offsets := _offsets(found)) else {}),
        **({"validation": found.validation} if found.validation else {}),
        "next_experiment": found.case.experiment([], sorted(curable)).sentence,
    }


def _offsets(found: "Identified") -> list[dict[str, Any]]:
    names, rows = found.estimate.offsets.keys(), zip(*found.estimate.offsets.values(), strict=True)
    return [
        {"recording": k}
        | {name: {"value": value, "ci": [low, high]} for name, (value, low, high) in zip(names, row, strict=True)}
        for k, row in enumerate(rows, 1)
    ]


def figures_of(found: "Identified") -> Figures:
    """The figures of a diagnosis, and the correlations of what was identified."""
    before, after = (found.case.samples(each) for each in (found.before, found.estimate.hypothesis))
    drawn = figures(found.recording, found.values, before, after, found.case.unit)
    labels = [title(label) for label in found.estimate.labels]
    drawn[CORRELATIONS] = correlations(labels, found.estimate.correlation)
    return drawn


def write_all(found: "Identified", out: Path) -> Path:
    """Write everything into a folder; returns the path of identified.json."""
    drawn, result = figures_of(found), content(found)
    write(out / "correlation.png", png(drawn.pop(CORRELATIONS)))
    for name, picture in zip(PICTURES, drawn.values(), strict=False):
        write(out / name, png(picture))
    found.posterior.write(out / "posterior.yaml")
    write_patch(result, found.recording, out / "patch")
    return write(out / "identified.json", json.dumps(result, indent=1, allow_nan=False))


def words_of(result: dict[str, Any]) -> str:
    """A result as a table and a few sentences."""
    table = Table(box=rich.box.SIMPLE, show_edge=False, pad_edge=False)
    for name in ("parameter", "simulator", "identified", "95 % interval", "unit"):
        table.add_column(name, justify="left" if name in ("parameter", "unit") else "right")
    for effect in result["effects"]:
        for key, each in effect["parameters"].items():
            was = words.rounded(each["nominal"], each["ci"]) if "nominal" in each else "–"
            interval = "held" if each.get("held") else words.interval(each)
            name = title((effect["name"], key)).replace("_", " ").replace(".", ", ")
            table.add_row(name, was, words.rounded(each["value"], each["ci"]), interval, each["unit"])
    text = io.StringIO()
    console = Console(file=text, width=WIDTH)
    console.print(table)
    return "\n".join([text.getvalue(), *_sentences(result)])


def _sentences(result: dict[str, Any]) -> list[str]:
    gap = result["gap"]
    before, after, floor = (f"{words.number(gap[key])} {gap['unit']}" for key in ("before", "after", "floor"))
    lines = [f"{gap['metric'].replace('_', ' ')}, held out: {before} before, {after} after; noise {floor}"]
    units = {
        "position_rmse": gap["unit"].removesuffix("/s"),
        "velocity_rmse": gap["unit"],
        "torque_error": "of the torque",
    }
    for where, errors in (("", result), (" on the other recording", result.get("validation", {}))):
        for key in (key for key in units if key in errors):
            one, other = (f"{words.number(errors[key][end])} {units[key]}" for end in ("before", "after"))
            lines.append(f"{key.replace('_', ' ')}{where}: {one} before, {other} after")
    for key, verb in (("unidentified", "not identified"), ("doubtful", "doubtful")):
        lines += [f"{verb}: {each['name'].replace('_', ' ')}, {each['why']}" for each in result[key]]
    return [*lines, result["next_experiment"]] if result["next_experiment"] else lines


def _effect(found: "Identified", name: str) -> dict[str, Any]:
    effect = JOINT_EFFECTS[name]
    given = effect.check(found.values[name])
    parameters: dict[str, dict[str, Any]] = {}
    for parameter in effect.parameters:
        if parameter.optional and given[parameter.name] == parameter.neutral:
            continue
        value = float(given[parameter.name])
        low, high = (value, value) if name in found.held else found.estimate.intervals[name][parameter.name]
        parameters[parameter.name] = {"value": value, "unit": found.case.unit_of(parameter), "ci": [low, high]}
        if name in DYNAMICS:
            parameters[parameter.name]["nominal"] = getattr(NominalJoint(**found.recording.nominal), name)
        if name in found.held:
            parameters[parameter.name]["held"] = True
    return {"name": name, "source": effect.source, "parameters": parameters}


def _gap(found: "Identified") -> dict[str, Any]:
    gap = found.gap
    shrink = gap.shrink(gap.after)
    levels = {key: float(np.sqrt(getattr(gap, key).mean())) for key in ("before", "refitted", "after", "floor")}
    return {
        "metric": found.case.metric,
        "unit": found.case.unit,
        "described": found.case.described,
        **levels,
        "shrink": shrink.value,
        "shrink_ci": list(shrink.ci),
    }
