"""What the transfer table compares, on which scenes and under which cameras."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from vision_s2r.errors import UserError, nearest

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

    policy: list[str] = field(default_factory=list)
    translator: list[str] | None = None
    picture: str = "source"
    trained_on: str = "canonical"

    @property
    def present(self) -> bool:
        """Whether all of the row's checkpoints are named."""
        return bool(self.policy) and self.translator != []


@dataclass
class EvaluateConfig:
    """A transfer table: rows of policies, columns of pictures, the same scenes in every cell."""

    scenes: str = "renders/test"
    out: str = "outputs/evaluate"
    limit: int = 0
    seed: int = 0
    appearances: list[str] = field(default_factory=lambda: list(APPEARANCES))
    cameras: list[str] = field(default_factory=list)
    effects: list[str] = field(default_factory=list)
    rows: dict[str, RowConfig] = field(default_factory=dict)
    differences: list[list[str]] = field(default_factory=list)
    ratios: list[list[str]] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    strip: int = 5
    worst: int = 12
    backend: str = "loky"
    workers: int = -1


def through_cameras(cfg: EvaluateConfig, rows: dict[str, RowConfig], cameras: list[str], out: Path) -> EvaluateConfig:
    """cfg for these rows and cameras alone, in the folder `out`, nothing compared."""
    nothing: dict[str, Any] = {key: [] for key in ("appearances", "effects", "differences", "ratios", "failures")}
    return replace(cfg, rows=rows, cameras=cameras, out=str(out), **nothing)


def check(cfg: EvaluateConfig) -> None:
    """Raise UserError for what contradicts itself; the names of cameras and effects are checked where they are read."""
    for name in ("limit", "seed", "strip", "worst"):
        if getattr(cfg, name) < 0:
            raise UserError(f"evaluate.{name} = {getattr(cfg, name)}: expected 0 or more")
    if cfg.workers == 0:
        raise UserError("evaluate.workers = 0: expected a number of processes, or -1 for one a core")
    for name in cfg.appearances:
        if name not in APPEARANCES:
            raise UserError(f"evaluate.appearances: {name}, {nearest(name, APPEARANCES)}")
    for name in ("appearances", "cameras", "effects"):
        given = getattr(cfg, name)
        if len(set(given)) < len(given):
            raise UserError(f"evaluate.{name} = {given}: expected each once")
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
    for key, known in (("picture", PICTURES), ("trained_on", POLICIES)):
        if getattr(row, key) not in known:
            raise UserError(f"{where}.{key} = '{getattr(row, key)}': {nearest(getattr(row, key), known)}")
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
