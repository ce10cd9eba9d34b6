"""The stages of the benchmark, in their order."""

from vision_s2r.gapbench.config import GapbenchConfig, check
from vision_s2r.gapbench.generate.generate import generate
from vision_s2r.gapbench.score.follow import follow_all
from vision_s2r.gapbench.score.run import score_all


def bench(cfg: GapbenchConfig) -> None:
    """Generate, score, or both, or follow. Raises UserError for bad values and folders that hold something else."""
    check(cfg)
    if cfg.stage in ("generate", "all"):
        generate(cfg)
    if cfg.stage in ("score", "all"):
        score_all(cfg)
    if cfg.stage == "follow":
        follow_all(cfg)
