"""Fill the transfer table: every row in every column, on the same scenes, from where it stopped."""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

from rich.console import Console
from torch import Tensor

from vision_s2r.evaluate import config, page
from vision_s2r.evaluate.attempts import Attempts
from vision_s2r.evaluate.cells import Cell, cell_path
from vision_s2r.evaluate.columns import Column, columns, pictures
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.evaluate.rows import Loaders, Runner, load_rows
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.evaluate.table import Table
from vision_s2r.progress import bar
from vision_s2r.scene import SceneConfig

CONSOLE = Console(stderr=True)
PAGE = "index.html"


def evaluate(cfg: EvaluateConfig, scene_cfg: SceneConfig, loaders: Loaders | None = None) -> Table:
    """Measure what is not yet measured and write table.csv, table.json and index.html into `cfg.out`.

    Raises UserError for a configuration, scenes or checkpoints that do not fit each other, and a full disk.
    """
    config.check(cfg)
    seen = columns(cfg)
    scenes = Scenes.open(cfg, scene_cfg)
    rows = load_rows(cfg, scenes.views.size, loaders or Loaders())
    for name in [name for name in cfg.rows if name not in rows]:
        CONSOLE.print(f"row {name} is left out: no checkpoints are configured")
    cells = _Cells(cfg, scenes, rows).fill(seen)
    table = Table(cfg, scenes, seen, {n: [r.checkpoints for r in runners] for n, runners in rows.items()}, cells)
    folder = Path(cfg.out)
    table.write(folder)
    page.write(table, rows, folder / PAGE)
    Console().print(table.text())
    CONSOLE.print(f"{folder / PAGE} shows what it looks like")
    return table


class _Cells:
    """The cells of a table, read from disk where they are still true, else measured."""

    def __init__(self, cfg: EvaluateConfig, scenes: Scenes, rows: dict[str, list[Runner]]) -> None:
        self._cfg, self._scenes, self._rows = cfg, scenes, rows
        self._attempts = Attempts(scenes, cfg.backend, cfg.workers)
        self._known: dict[str, Cell] = {}  # by fingerprint: an oracle's cells are the same in all columns
        self._on_disk: set[Path] = set()

    def fill(self, seen: list[Column]) -> dict[tuple[str, str], list[Cell]]:
        """Every cell, by row and column, for each training seed; each is on disk as soon as it is known."""
        self._read(seen)
        cells: dict[tuple[str, str], list[Cell]] = {}
        with bar() as progress:
            count = len(seen) * sum(map(len, self._rows.values()))
            task = progress.add_task("grasps", total=count * len(self._scenes))
            for column in seen:
                source = cache(partial(pictures, column, self._scenes.views, self._cfg.seed))
                for row, runners in self._rows.items():
                    progress.update(task, description=f"{column.name}: {row}")
                    for k, runner in enumerate(runners):
                        cell = self._cell(runner, column, source, partial(progress.advance, task))
                        self._save(cell, row, column, k)
                        cells.setdefault((row, column.name), []).append(cell)
        return cells

    def _read(self, seen: list[Column]) -> None:
        """Take over what an earlier run left that is still true."""
        for column in seen:
            for row, runners in self._rows.items():
                for k, runner in enumerate(runners):
                    path, key = self._path(row, column, k), self._fingerprint(runner, column)
                    cell = Cell.load(path, key)
                    if cell:
                        self._known[key] = cell
                        self._on_disk.add(path)
                        self._attempts.remember(cell.grasps, cell.outcomes)

    def _cell(
        self, runner: Runner, column: Column, source: Callable[[], Tensor], advance: Callable[[float], None]
    ) -> Cell:
        key = self._fingerprint(runner, column)
        if key in self._known:
            advance(len(self._scenes))
        else:
            grasps, q = runner.act(source(), self._scenes)
            self._known[key] = Cell(grasps, q, self._attempts(grasps, advance))
        return self._known[key]

    def _save(self, cell: Cell, row: str, column: Column, seed: int) -> None:
        path = self._path(row, column, seed)
        if path not in self._on_disk:
            cell.save(path, self._fingerprint(self._rows[row][seed], column))

    def _path(self, row: str, column: Column, seed: int) -> Path:
        return cell_path(Path(self._cfg.out), row, column.name, seed)

    def _fingerprint(self, runner: Runner, column: Column) -> str:
        return runner.fingerprint(column, self._scenes, self._cfg.seed)
