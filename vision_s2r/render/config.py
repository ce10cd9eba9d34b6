"""What to render, how much of it, and where it goes."""

from dataclasses import dataclass

from vision_s2r.errors import UserError
from vision_s2r.options import option, validate
from vision_s2r.parallel import backend_option


@dataclass
class RenderConfig:
    """One set of rendered scenes."""

    out: str = option(
        "renders/default", "Folder of the shards, the manifest and the contact sheet; one that is there is continued."
    )
    scenes: int = option(2000, "How many scenes.", low=1)
    seed: int = option(0, "That they are drawn from: scene i of a seed is always the same.", low=0)
    turns: int = option(
        1,
        "Scenes in a row that are one settled scene, each a quarter turn on, with its own arm pose and camera; a "
        "divisor of shard_size. Above 1 there are no grasps; pictures cost half, as most of a scene is its settling.",
        low=1,
        high=4,
    )
    size: int = option(64, "Side of a picture, pixels.", low=16)
    source_scale: int = option(
        1,
        "Times as many pixels a side as the canonical picture have source pictures, randomized and real: a camera of "
        "more pixels, over the same labels.",
        low=1,
        high=8,
    )
    margin: int = option(8, "Pixels that source pictures have more on each side, for lenses that warp.", low=0)
    views: int = option(3, "Randomized pictures of each scene.", low=0)
    real: bool = option(False, "Whether the real appearance is rendered too.")
    grasps: int = option(
        6, "Simulated grasps of each scene: one in six at random, two on an object, three scripted.", low=0
    )
    shard_size: int = option(50, "Scenes in a file; an interruption costs at most the shards in flight.", low=1)
    backend: str = backend_option()
    store: str = option(
        "",
        "An fsspec address (s3://BUCKET/…) where shards go as well, and from where missing ones come: nodes then need "
        "share no folder.",
    )
    workers: int = option(-1, "Processes of the backend; -1: one a core.", low=-1)


def check(cfg: RenderConfig) -> None:
    """Raise UserError where a number makes no sense."""
    validate(cfg, "render")
    check_workers("render", cfg.workers)
    if cfg.shard_size % cfg.turns:
        raise UserError(f"render.turns = {cfg.turns}: expected a divisor of render.shard_size {cfg.shard_size}")
    if cfg.turns > 1 and cfg.grasps:
        raise UserError("render.turns above 1 renders pictures alone: expected render.grasps=0")


def check_workers(where: str, workers: int) -> None:
    """Raise UserError for no process at all."""
    if not workers:
        raise UserError(f"{where}.workers = 0: expected a number of processes, or -1 for one a core")
