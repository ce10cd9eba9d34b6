"""What to render, how much of it, and where it goes."""

from dataclasses import dataclass

from vision_s2r.errors import UserError


@dataclass
class RenderConfig:
    """One set of rendered scenes."""

    out: str = "renders/default"
    scenes: int = 2000
    seed: int = 0
    size: int = 64
    margin: int = 8
    views: int = 3
    real: bool = False
    grasps: int = 6
    shard_size: int = 50
    backend: str = "loky"
    workers: int = -1


def check(cfg: RenderConfig) -> None:
    """Raise UserError where a number makes no sense."""
    for name, low in {"scenes": 1, "size": 16, "margin": 0, "views": 0, "grasps": 0, "shard_size": 1}.items():
        if getattr(cfg, name) < low:
            raise UserError(f"render.{name} = {getattr(cfg, name)}: expected at least {low}")
    if cfg.workers == 0:
        raise UserError("render.workers = 0: expected a number of processes, or -1 for one a core")
