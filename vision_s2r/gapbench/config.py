"""What a sealed benchmark draws and how it is scored."""

from dataclasses import dataclass, field

from vision_s2r.errors import UserError, nearest
from vision_s2r.gapbench.generate.base import CASES, SPLITS

STAGES = ("generate", "score", "all")
KINDS = ("joint", "camera")


@dataclass
class GapbenchConfig:
    """Keys of configs/gapbench.yaml, where each is described."""

    stage: str = "all"
    kind: str = "joint"
    set: str = "tuning"
    seed: int = 0
    counts: dict[str, int] = field(default_factory=dict)
    jobs: int = 2
    limit: int = 0
    timeout: float = 300.0
    out: str = "outputs/gapbench"
    diagnose: list[str] = field(default_factory=list)


def check(cfg: GapbenchConfig) -> None:
    """Raise UserError for a value that is out of range."""
    for key, value, known in (
        ("stage", cfg.stage, STAGES),
        ("kind", cfg.kind, KINDS),
        ("set", cfg.set, SPLITS),
    ):
        if value not in known:
            raise UserError(f"gapbench: {key}={value} is not known; {nearest(value, known)}")
    for case, count in cfg.counts.items():
        if case not in CASES:
            raise UserError(f"gapbench: no case '{case}' in counts; {nearest(case, CASES)}")
        if count < 0:
            raise UserError(f"gapbench: counts.{case}={count}, expected 0 or more")
    if cfg.jobs < 1 or cfg.seed < 0 or cfg.limit < 0 or cfg.timeout <= 0:
        raise UserError("gapbench: expected jobs ≥ 1, seed ≥ 0, limit ≥ 0 and timeout > 0")
