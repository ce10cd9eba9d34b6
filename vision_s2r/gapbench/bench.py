"""The stages of the benchmark, in their order."""

from vision_s2r.gapbench.config import GapbenchConfig, check
from vision_s2r.gapbench.judge.judge import judge
from vision_s2r.gapbench.seal.seal import seal


def bench(cfg: GapbenchConfig) -> None:
    """Seal, judge, or both. Raises UserError for bad values and folders that hold something else."""
    check(cfg)
    if cfg.stage in ("seal", "all"):
        seal(cfg)
    if cfg.stage in ("judge", "all"):
        judge(cfg)
