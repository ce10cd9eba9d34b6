"""The memory of a process that renders shard after shard, as a worker does; and what a day of it would come to."""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import theilslopes

from vision_s2r.progress import tracked
from vision_s2r.render import RenderConfig
from vision_s2r.render.manifest import shard_path
from vision_s2r.render.shard import render_shard, write
from vision_s2r.scene import SceneConfig

VIEWS = 100  # renders a shard, of one scene
DAY = 86400.0  # s
CONFIDENCE = 0.95


def grown(renders: int, seed: int) -> dict[str, Any]:
    """Render so many pictures; megabytes held after the first half and at the end, and their slope taken to a day.

    The slope is the median of those between any two shards (Theil and Sen) of the second half, with its interval: in
    the first, textures and bodies that a process keeps are met for the first time, and a leak would show in both.
    """
    shards = max(renders // VIEWS, 20)
    cfg = RenderConfig(scenes=shards, seed=seed, size=32, margin=4, views=VIEWS, grasps=2, shard_size=1)
    held, seconds, begun = [], [], time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        for number in tracked(range(shards), shards, "shards"):
            path = shard_path(Path(folder), number)
            write(path, render_shard(SceneConfig(), cfg, number))
            path.unlink()
            held.append(_resident())
            seconds.append(time.perf_counter() - begun)
    first = shards // 2
    slope, _, low, high = DAY * np.array(theilslopes(held[first:], seconds[first:], CONFIDENCE))
    return {
        "renders": shards * VIEWS,
        "minutes": round(seconds[-1] / 60, 1),
        "MB after half of them": round(held[first], 1),
        "MB at the end": round(held[-1], 1),
        "MB more in 24 h": round(slope, 1),
        "from": round(low, 1),
        "to": round(high, 1),
        "held": [round(each, 2) for each in held],
    }


def _resident() -> float:
    """Megabytes of this process in memory."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6
