"""The configuration of a diagnosis, as configs/diagnose.yaml has it."""

from dataclasses import dataclass, field
from typing import Any

from hydra.core.config_store import ConfigStore

from vision_s2r.errors import UserError
from vision_s2r.recording.folders import folders


@dataclass
class SearchConfig:
    """When an effect is worth a name, and how far the search goes."""

    evidence: float = 8.0  # nats of held-out log-likelihood that an effect must bring
    local: float = 10.0  # nats that are enough where the floor is reached, wherever they come from
    confidence: float = 0.999  # at which the evidence must be above zero, by block bootstrap
    relief: float = 0.03  # by which it must lower the excess, in units of the noise's variance …
    share: float = 0.03  # … and by which share of the excess over the floor
    promising: float = 20.0  # nats that an effect must seem to gain to be tried where the floor is reached
    adequate: float = 0.10  # an excess over the floor up to this is none
    tolerance: float = 0.05  # … nor is one of up to this share of what the nominal simulator leaves
    most: int = 5  # effects named at most
    folds: int = 5  # of segments, held out in turn
    beam: int = 3  # sets that are grown at each size
    breadth: int = 12  # effects tried on each of them, the most promising by the screen
    contenders: int = 4  # grown sets that are held out


@dataclass
class DiagnoseConfig:
    """Everything that scripts/diagnose.py reads."""

    recording: Any = None  # DIR or [DIR, …]
    out: str = "outputs/diagnosis"
    jobs: int = 2
    seed: int = 0
    withhold: list[str] = field(default_factory=list)
    joint: SearchConfig = field(default_factory=SearchConfig)
    camera: SearchConfig = field(default_factory=SearchConfig)


def check(cfg: DiagnoseConfig) -> None:
    """UserError unless every value can be."""
    for kind, search in (("joint", cfg.joint), ("camera", cfg.camera)):
        for key in ("evidence", "local", "relief", "share", "promising", "adequate", "tolerance"):
            if getattr(search, key) < 0:
                raise UserError(f"{kind}.{key} is {getattr(search, key)}, expected 0 or more")
        if not 0.5 <= search.confidence < 1:
            raise UserError(f"{kind}.confidence is {search.confidence}, expected 0.5 to below 1")
        for key, least in (("most", 1), ("folds", 2), ("beam", 1), ("breadth", 1), ("contenders", 1)):
            if getattr(search, key) < least:
                raise UserError(f"{kind}.{key} is {getattr(search, key)}, expected {least} or more")
    folders(cfg.recording)
    if cfg.jobs < 1:
        raise UserError(f"jobs is {cfg.jobs}, expected 1 or more")


ConfigStore.instance().store("diagnose_schema", node=DiagnoseConfig)
