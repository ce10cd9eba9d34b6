"""The configuration of `vision-s2r metrics`."""

from dataclasses import dataclass
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate


@dataclass
class MetricsConfig:
    """Which evaluations are looked into."""

    tables: Any = option(
        None,
        "Folder that `vision-s2r evaluate` finished, or several: tables=[DIR,DIR]; their rows with a translator are "
        "measured.",
    )
    out: str = option("outputs/metrics", "Folder of what is measured.")
    seed: int = option(0, "Of the resamples behind the intervals.", low=0)


ConfigStore.instance().store("metrics_schema", node=MetricsConfig)


def checked(cfg: MetricsConfig) -> list[str]:
    """The folders of `cfg.tables`. Raises UserError where a value is out of its range."""
    validate(cfg)
    tables = [cfg.tables] if isinstance(cfg.tables, str) else cfg.tables
    if not isinstance(tables, list) or not tables or not all(isinstance(each, str) and each for each in tables):
        raise UserError(
            f"tables = {cfg.tables}: expected tables=DIR or tables=[DIR,DIR] that vision-s2r evaluate finished"
        )
    if len(set(tables)) < len(tables):
        raise UserError(f"tables = {tables}: expected each once")
    return tables
