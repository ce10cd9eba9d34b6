"""The configuration of scripts/metrics.py, as configs/metrics.yaml has it."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError


@dataclass
class MetricsConfig:
    """Which evaluations are looked into."""

    tables: Any = None  # DIR or [DIR, …]
    out: str = "outputs/metrics"
    seed: int = 0


ConfigStore.instance().store("metrics_schema", node=MetricsConfig)


def checked(cfg: MetricsConfig) -> list[str]:
    """The folders of `cfg.tables`. Raises UserError where a value is out of its range."""
    tables = [cfg.tables] if isinstance(cfg.tables, str) else cfg.tables
    if not isinstance(tables, list) or not tables or not all(isinstance(each, str) and each for each in tables):
        raise UserError(
            f"tables = {cfg.tables}: expected tables=DIR or tables=[DIR,DIR] that scripts/evaluate.py finished"
        )
    if len(set(tables)) < len(tables):
        raise UserError(f"tables = {tables}: expected each once")
    if cfg.seed < 0:
        raise UserError(f"seed = {cfg.seed}: expected 0 or more")
    return tables
