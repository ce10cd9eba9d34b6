"""The page: the table, and what it looks like."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from torch import Tensor

from vision_s2r import files
from vision_s2r.evaluate import drawing
from vision_s2r.evaluate.columns import Column, pictures
from vision_s2r.evaluate.rows import Runner
from vision_s2r.evaluate.table import Comparison, Table

TEMPLATE = "page.html"


@dataclass(frozen=True)
class Failure:
    """A scene in which the first of two rows failed and the second did not: training seed, scene, Q."""

    column: Column
    seed: int
    scene: int
    q: float


def write(table: Table, rows: dict[str, list[Runner]], path: Path) -> None:
    """Write one page that needs no other file, and the strips of the first camera beside it as strip.png.

    Raises UserError where that cannot be.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("vision_s2r.evaluate"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["words"] = lambda name: name.replace("_", " ")
    strips = {column.name: dict(_strips(table, rows, column)) for column in table.columns}
    text = environment.get_template(TEMPLATE).render(
        table=table,
        differences=_by_pair(table.differences),
        ratios=_by_pair(table.ratios),
        cameras=_cameras(table),
        strips={name: {row: drawing.data_uri(each) for row, each in found.items()} for name, found in strips.items()},
        failures=[_failure(table, rows, failure) for failure in worst_failures(table)],
    )
    files.write(path, text)
    shown = next((column.name for column in table.columns if column.camera), table.columns[0].name)
    if strips[shown]:
        files.write(path.with_name("strip.png"), drawing.png(drawing.sheet(strips[shown])))


def worst_failures(table: Table) -> list[Failure]:
    """Where the first row of `failures` was surest of a grasp that failed, and the second row's held.

    Each scene is there once, with the column and the training seed of the highest Q; highest first.
    """
    if not table.cfg.failures or not set(table.cfg.failures) <= set(table.rows):
        return []
    first, second = table.cfg.failures
    found: dict[int, Failure] = {}
    for column in table.columns:
        pairs = zip(table.cells[first, column.name], table.cells[second, column.name], strict=False)
        for seed, (cell, other) in enumerate(pairs):
            for scene in np.flatnonzero(~cell.success & other.success).tolist():
                failure = Failure(column, seed, scene, float(cell.q[scene]))
                if scene not in found or found[scene].q < failure.q:
                    found[scene] = failure
    return sorted(found.values(), key=lambda failure: -failure.q)[: table.cfg.worst]


def _by_pair(comparisons: list[Comparison]) -> dict[tuple[str, str], dict[str, Comparison]]:
    """By pair of rows, then by column."""
    found: dict[tuple[str, str], dict[str, Comparison]] = {}
    for comparison in comparisons:
        found.setdefault((comparison.first, comparison.second), {})[comparison.column] = comparison
    return found


def _cameras(table: Table) -> list[dict[str, Any]]:
    """Which camera each row's networks were trained under, and which chose their checkpoints."""
    return [
        {"row": row, "role": role, **{key: name or "–" for key, name in known["cameras"].items()}}
        for row, seeds in table.checkpoints.items()
        for role, known in seeds[0].items()
    ]


def _strips(table: Table, rows: dict[str, list[Runner]], column: Column) -> Iterator[tuple[str, np.ndarray]]:
    """(label, uint8 RGB) of the first scenes: the pictures, unless a row shows them; what each row saw and chose."""
    count = min(table.cfg.strip, len(table.scenes))
    if not count:
        return
    source, canonical = _look(table, column, list(range(count)))
    views = table.scenes.views.subset(range(count))
    geometry = list(zip(views.all("intrinsics").numpy(), views.all("extrinsics").numpy(), strict=True))
    if not any(runners[0].sees_source for runners in rows.values()):
        plain = [drawing.tile(picture, *camera) for picture, camera in zip(source.numpy(), geometry, strict=True)]
        yield "picture", drawing.strip(plain)
    for row, runners in rows.items():
        cell = table.cells[row, column.name][0]
        seen = runners[0].look(source, canonical).numpy()
        tiles = [drawing.tile(seen[k], *geometry[k], cell.grasps[k], bool(cell.success[k])) for k in range(count)]
        yield row, drawing.strip(tiles)


def _failure(table: Table, rows: dict[str, list[Runner]], failure: Failure) -> dict[str, Any]:
    """One failure: the picture, what the row made of it, and the truth with its grasp and with that which held."""
    first, second = table.cfg.failures
    cell, other = (table.cells[row, failure.column.name][failure.seed] for row in (first, second))
    k = failure.scene
    source, canonical = _look(table, failure.column, [k])
    seen = rows[first][failure.seed].look(source, canonical)[0].numpy()
    views = table.scenes.views.subset([k])
    camera = views.all("intrinsics")[0].numpy(), views.all("extrinsics")[0].numpy()
    truth = canonical[0].numpy()
    tiles = [
        drawing.tile(source[0].numpy(), *camera),
        drawing.tile(seen, *camera, cell.grasps[k], False),
        drawing.tile(truth, *camera, cell.grasps[k], False),
        drawing.tile(truth, *camera, other.grasps[k], True),
    ]
    return {
        "column": failure.column.name,
        "scene": table.scenes.states[k].index,
        "seed": failure.seed,
        "q": failure.q,
        "reason": cell.outcomes[k].reason,
        "picture": drawing.data_uri(drawing.strip(tiles)),
    }


def _look(table: Table, column: Column, scenes: list[int]) -> tuple[Tensor, Tensor]:
    """The column's pictures and the true canonical ones of some scenes."""
    views = table.scenes.views.subset(scenes)
    return pictures(column, views, table.cfg.seed), views.all("canonical")
