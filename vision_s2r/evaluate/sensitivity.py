"""How much of each camera effect a way from picture to grasp bears: success against the effect's strength, alone.

Strength 1 is the effect's moderate setting, 0 no effect; between and beyond, parameters move on their own scale from
the neutral value. Changes of the real look's light and surfaces (`scene/changes.py`) stand beside them. In: the rows of
an evaluation. Out: sensitivity.json, .csv and .png, and table.json for a page.
"""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import yaml

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.camera.strength import at
from vision_s2r.errors import UserError
from vision_s2r.evaluate.columns import REFERENCE_SIZE
from vision_s2r.evaluate.config import EvaluateConfig, through_cameras
from vision_s2r.evaluate.evaluate import evaluate
from vision_s2r.evaluate.publish import percent
from vision_s2r.evaluate.sensitivity_config import SensitivityConfig, check
from vision_s2r.files import write, write_figure, write_table
from vision_s2r.results import command_line
from vision_s2r.scene import SceneConfig

SUMMARY, CSV, PICTURE, TABLE = "sensitivity.json", "sensitivity.csv", "sensitivity.png", "table.json"
NONE = "none"  # the camera without any effect


def sensitivity(cfg: SensitivityConfig, table: EvaluateConfig, scene: SceneConfig, out: Path) -> Path:
    """Measure, or go on with, every curve in the folder `out`; returns the summary (JSON).

    `table`: the evaluation, of which scenes, seed and checkpoints are taken. Raises UserError as `evaluate`.
    """
    check(cfg)
    wanted = cfg.rows or [name for name, row in table.rows.items() if row.picture == "source"]
    rows = {name: table.rows[name] for name in table.rows if name in wanted}
    if missing := [name for name in wanted if name not in rows]:
        raise UserError(f"sensitivity.rows: no row '{missing[0]}' in evaluate.rows, known: {', '.join(table.rows)}")
    effects = [CAMERA_EFFECTS[name] for name in cfg.effects] or list(CAMERA_EFFECTS)
    cameras = {NONE: write(out / "cameras" / f"{NONE}.yaml", yaml.safe_dump({"effects": {}}))}
    for effect in effects:
        for strength in cfg.strengths:
            name = column(effect.name, strength)
            camera = {"reference_size": REFERENCE_SIZE, "effects": {effect.name: at(effect, strength)}}
            cameras[name] = write(out / "cameras" / f"{name}.yaml", yaml.safe_dump(camera))
    changes = {column(name, strength): {name: strength} for name in cfg.changes for strength in cfg.strengths}
    settings = through_cameras(table, rows, [str(path) for path in cameras.values()], out / "table", changes)
    found = evaluate(replace(settings, limit=cfg.limit), scene)
    points: list[dict[str, Any]] = []
    for row in found.rows:
        for effect_name in [*(effect.name for effect in effects), *cfg.changes]:
            for strength in (0.0, *cfg.strengths):
                name = column(effect_name, strength) if strength else NONE
                attempts = found.outcomes(row, name).size
                point = {"row": row, "effect": effect_name, "strength": strength, "attempts": attempts}
                points.append(point | asdict(found.success(row, name)))
    write_table(out / CSV, points)
    draw(points, out / PICTURE)
    write(out / TABLE, json.dumps(as_table(points), indent=1) + "\n")
    return write(out / SUMMARY, json.dumps(points, indent=1) + "\n")


def as_table(points: list[dict[str, Any]]) -> dict[str, Any]:
    """A line for each effect, a column for each row and strength: success in percent with its 95 % interval."""
    at_each = {(point["effect"], point["row"], point["strength"]): point for point in points}
    pairs = list(dict.fromkeys((row, strength) for _, row, strength in at_each if strength))
    rows = [
        [effect.replace("_", " "), *(percent(at_each[effect, *pair]) for pair in pairs)]
        for effect in dict.fromkeys(effect for effect, _, _ in at_each)
    ]
    none = {row: point for (_, row, strength), point in at_each.items() if not strength}
    rows.append(["none", *(percent(none[row]) for row, _ in pairs)])
    columns = ["effect alone", *(f"{row.replace('_', ' ')}, × {strength:g}" for row, strength in pairs)]
    return {"command": command_line("vision-s2r sensitivity"), "columns": columns, "rows": rows}


def column(name: str, strength: float) -> str:
    """The name of a column: what is changed, and the strength in hundredths."""
    return f"{name}-{round(100 * strength)}"


def draw(points: list[dict[str, Any]], path: Path) -> Path:
    """A small plot an effect, a line a row, 95 % intervals; returns the PNG's path."""
    from matplotlib.figure import Figure  # half a second, which no other command of the pipeline waits for

    effects = list(dict.fromkeys(point["effect"] for point in points))
    columns = min(5, len(effects))
    lines = -(-len(effects) // columns)
    figure = Figure(figsize=(2.4 * columns, 2.0 * lines + 0.5), layout="constrained")
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for place, effect in zip(axes.flat, effects, strict=False):
        for row in dict.fromkeys(point["row"] for point in points):
            some = [point for point in points if point["effect"] == effect and point["row"] == row]
            at_strength = [point["strength"] for point in some]
            value, low, high = ([100 * point[key] for point in some] for key in ("value", "low", "high"))
            (line,) = place.plot(at_strength, value, "o-", ms=3, lw=1.2, label=row.replace("_", " "))
            place.fill_between(at_strength, low, high, color=line.get_color(), alpha=0.15, lw=0)
        place.set_title(effect.replace("_", " "), fontsize=8)
        place.set_ylim(0, 100)
        place.grid(alpha=0.3)
        place.tick_params(labelsize=7)
    for place in list(axes.flat)[len(effects) :]:
        place.set_axis_off()
    figure.supxlabel("strength (1: the effect's moderate setting)", fontsize=8)
    figure.supylabel("grasps held, %", fontsize=8)
    figure.legend(*axes.flat[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8)
    return write_figure(path, figure, dpi=120)
