"""A finished evaluation, read back: its scenes, columns, rows with a translator, and their grasps' success."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from omegaconf import OmegaConf

from vision_s2r.camera import CameraConfig
from vision_s2r.cli import typed
from vision_s2r.errors import UserError
from vision_s2r.evaluate.cells import Cell, cell_path
from vision_s2r.evaluate.columns import Column
from vision_s2r.evaluate.config import EvaluateConfig, RowConfig
from vision_s2r.evaluate.rows import Loaders, Runner, load_rows
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.evaluate.table import FORMAT
from vision_s2r.scene import SceneConfig


@dataclass(frozen=True)
class Evaluation:
    """A finished evaluation; `rows` are those with a translator."""

    folder: Path
    seed: int
    scenes: Scenes
    columns: list[Column]
    rows: dict[str, list[Runner]]

    @classmethod
    def open(cls, folder: Path, loaders: Loaders) -> "Evaluation":
        """Raises UserError where the folder is none, and where its scenes or checkpoints are not to be had."""
        table = _table(folder)
        try:
            rows = {name: _row(known) for name, known in table["checkpoints"].items() if "translator" in known[0]}
            cfg = EvaluateConfig(
                table["scenes"]["folder"], limit=table["scenes"]["count"], seed=table["seed"], rows=rows
            )
            columns = [_column(**column) for column in table["columns"]]
            scene = OmegaConf.create(table["scenes"]["scene"])
        except (KeyError, TypeError, IndexError) as error:
            raise UserError(
                f"{folder / 'table.json'} is damaged ({error!r}): run `vision-s2r evaluate` again"
            ) from error
        scenes = Scenes.open(cfg, typed(scene, SceneConfig))
        return cls(folder, cfg.seed, scenes, columns, load_rows(cfg, scenes.views.size, loaders))

    def success(self, row: str, column: Column, k: int) -> np.ndarray:
        """Which grasps of the row's k-th training seed held, bool [N].

        Raises UserError where they are not there, or are of other checkpoints or scenes than lie there now.
        """
        path = cell_path(self.folder, row, column.name, k)
        cell = Cell.load(path, self.rows[row][k].fingerprint(column, self.scenes, self.seed))
        if cell is None:
            raise UserError(
                f"{path} is missing, damaged, or of other checkpoints or scenes than are there now: "
                "run `vision-s2r evaluate` again"
            )
        return cell.success


def _table(folder: Path) -> dict[str, Any]:
    path = folder / "table.json"
    try:
        table = json.loads(path.read_text())
    except OSError as error:
        raise UserError(f"{path} cannot be read: expected a folder that `vision-s2r evaluate` finished") from error
    except ValueError as error:
        raise UserError(f"{path} is not JSON: {error}") from error
    if not isinstance(table, dict) or table.get("format") != FORMAT:
        raise UserError(f"{path}: expected format '{FORMAT}', as `vision-s2r evaluate` writes it")
    return table


def _row(checkpoints: list[dict[str, Any]]) -> RowConfig:
    policies, translators = ([known[role]["path"] for known in checkpoints] for role in ("policy", "translator"))
    return RowConfig(policies, translators, trained_on=checkpoints[0]["policy"]["configuration"]["picture"])


def _column(name: str, appearance: str, camera: dict[str, Any] | None, changes: dict[str, float]) -> Column:
    return Column(name, appearance, None if camera is None else CameraConfig(**camera), changes)
