"""What the transfer table compares, on which scenes and under which cameras."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError, nearest
from vision_s2r.options import option, validate
from vision_s2r.parallel import backend_option
from vision_s2r.render.config import check_workers

PICTURES = ("canonical", "source")
APPEARANCES = ("canonical", "randomized", "real")
POLICIES = ("canonical", "randomized", "seen")


@dataclass
class RowConfig:
    """One row of the table: a policy, the pictures it is given, and what translates them first.

    `policy` and `translator` hold a checkpoint for each training seed, in the same order. A translator of None says
    that the row has none; an empty list, like an empty list of policies, that it is not there yet: the row is left
    out.
    """

    policy: list[str] = option([], "Its checkpoints, one for each training seed; none: the row is left out.")
    translator: list[str] | None = option(
        None, "As many, used in the same order; null: the row has none, []: not there yet, the row is left out."
    )
    picture: str = option(
        "source",
        "What it looks at: source (the column's picture) or canonical (the true canonical render).",
        choices=PICTURES,
    )
    trained_on: str = option(
        "canonical", "What its policy was trained on: canonical, randomized or seen pictures.", choices=POLICIES
    )
    mirrored: bool = option(
        False, "Whether translator and policy look at the mirror image as well, and go by the mean: twice the time."
    )

    @property
    def present(self) -> bool:
        """Whether all of the row's checkpoints are named."""
        return bool(self.policy) and self.translator != []


@dataclass
class EvaluateConfig:
    """A transfer table: rows of policies, columns of pictures, the same scenes in every cell."""

    scenes: str = option(
        "renders/test",
        "Folder of rendered test scenes: unseen objects (scene.objects.split=test), randomized and real pictures.",
    )
    out: str = option(
        "outputs/evaluate",
        "Where the table goes: table.csv, table.json, index.html, and the finished cells, from which it goes on.",
    )
    limit: int = option(0, "How many of the scenes, from the first; 0: all.", low=0)
    seed: int = option(0, "Of the cameras' parameters, of the policies' search and of the bootstrap.", low=0)
    appearances: list[str] = option(
        list(APPEARANCES),
        "A column for each of these appearances, through a perfect camera.",
        choices=APPEARANCES,
        unique=True,
    )
    cameras: list[str] = option(
        [],
        "A column for each of these cameras on the real appearance: names in configs/camera, or YAML files.",
        unique=True,
    )
    effects: list[str] = option(
        [],
        "A column for each of these camera effects alone, at its moderate setting, on the real appearance.",
        unique=True,
    )
    changes: dict[str, dict[str, float]] = option(
        {},
        "A column, by its name, of the real appearance with its light or surfaces changed: low_light, dim_light, "
        "hard_light, gloss, camouflage, each so far (1: moderately).",
    )
    rows: dict[str, RowConfig] = option({}, "By name: policies, what they look at, and what translates it first.")
    differences: list[list[str]] = option([], "Differences of success, first row minus second, over the same scenes.")
    ratios: list[list[str]] = option([], "Ratios of success, first row over second.")
    failures: list[str] = option(
        [], "The worst failures shown: of the first row, in scenes where the second succeeded."
    )
    strip: int = option(5, "Scenes in the picture strip of each column.", low=0)
    worst: int = option(12, "How many of the worst failures are shown.", low=0)
    backend: str = backend_option()
    workers: int = option(-1, "Processes of the backend; -1: one a core.", low=-1)


def through_cameras(
    cfg: EvaluateConfig,
    rows: dict[str, RowConfig],
    cameras: list[str],
    out: Path,
    changes: dict[str, dict[str, float]] | None = None,
) -> EvaluateConfig:
    """cfg for these rows, cameras and changes of the look alone, in the folder `out`, nothing compared."""
    nothing: dict[str, Any] = {key: [] for key in ("appearances", "effects", "differences", "ratios", "failures")}
    return replace(cfg, rows=rows, cameras=cameras, changes=changes or {}, out=str(out), **nothing)


def check(cfg: EvaluateConfig) -> None:
    """Raise UserError for what contradicts itself; the names of cameras and effects are checked where they are read."""
    validate(cfg, "evaluate")
    check_workers("evaluate", cfg.workers)
    for name, row in cfg.rows.items():
        _check_row(name, row)
    if not any(row.present for row in cfg.rows.values()):
        raise UserError("evaluate.rows: no row has its checkpoints, expected at least one")
    for key in ("differences", "ratios"):
        for pair in getattr(cfg, key):
            _check_pair(key, pair, cfg)
    if cfg.failures:
        _check_pair("failures", cfg.failures, cfg)


def _check_row(name: str, row: RowConfig) -> None:
    where = f"evaluate.rows.{name}"
    if row.translator is None:
        return
    if row.picture == "canonical":
        raise UserError(f"{where}: canonical pictures need no translator, expected translator: null")
    if row.present and len(row.translator) != len(row.policy):
        raise UserError(
            f"{where}: {len(row.translator)} translators for {len(row.policy)} policies, expected one for each"
        )


def _check_pair(key: str, pair: list[str], cfg: EvaluateConfig) -> None:
    if len(pair) != 2 or pair[0] == pair[1]:
        raise UserError(f"evaluate.{key}: {pair}, expected the names of two rows")
    for name in pair:
        if name not in cfg.rows:
            raise UserError(f"evaluate.{key}: no row '{name}', {nearest(name, cfg.rows)}")
