"""What a million scenes cost, from the measured cost of one: on one node, ten and a hundred.

Processor seconds are measured, not the clock's, so that it does not matter what else the machine does. Scenes are
independent and nothing is exchanged between nodes. What does not spread is the driver, which hears of each shard and
writes the manifest anew: its seconds a shard bound the rate.
"""

import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from vision_s2r.render import shard as shards
from vision_s2r.render.config import RenderConfig
from vision_s2r.render.manifest import Manifest, shard_path
from vision_s2r.results import publish
from vision_s2r.scene import SceneConfig

MEASURED = 40  # scenes
SCENES = 1_000_000
NODES, CORES = (1, 10, 100), 16  # of each node
COLUMNS = (
    *("scenes with", "processor s a scene", "kB a scene", "core hours", "GB"),
    *(f"hours, {count} node{'s' * (count > 1)}" for count in NODES),
    *("driver, ms a shard", "driver, hours in all", "nodes that it keeps busy"),
)


def run(scene: SceneConfig, sets: dict[str, RenderConfig], out: Path) -> Path:
    """Measure sets by what they hold; prints scale.json, writes it, and returns its path."""
    rows = [_row(name, scene, cfg) for name, cfg in sets.items()]
    title = f"{SCENES:,} scenes on nodes of {CORES} cores"
    return publish(out / "scale.json", "vision-s2r benchmark scale", COLUMNS, rows, title)


def _row(name: str, scene: SceneConfig, cfg: RenderConfig) -> list[Any]:
    seconds, size = _cost(scene, cfg)
    driver = _driver(scene, cfg)
    count = -(-SCENES // cfg.shard_size)
    hours = SCENES * seconds / 3600
    spread = [max(hours / (CORES * nodes), count * driver / 3600) for nodes in NODES]
    busy = seconds * cfg.shard_size / driver / CORES
    numbers = [seconds, size / 1e3, hours, SCENES * size / 1e9, *spread, 1e3 * driver, count * driver / 3600, busy]
    return [f"{name}, shards of {cfg.shard_size}", *numbers]


def _cost(scene: SceneConfig, cfg: RenderConfig) -> tuple[float, float]:
    """Processor seconds and bytes of a scene, the second shard's: meshes and textures are made once."""
    some = replace(cfg, scenes=2 * MEASURED, shard_size=MEASURED)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(2):
            before = time.process_time()
            path = shard_path(Path(folder), number)
            shards.write(path, shards.render_shard(scene, some, number))
        return (time.process_time() - before) / MEASURED, path.stat().st_size / MEASURED


def _driver(scene: SceneConfig, cfg: RenderConfig) -> float:
    """Seconds for which one shard keeps the driver, at the end of the set: the manifest is longest then."""
    manifest = Manifest.new(scene, replace(cfg, scenes=SCENES))
    manifest.checksums = {k: f"{k:064x}" for k in range(manifest.shard_count)}
    with tempfile.TemporaryDirectory() as folder:
        before = time.process_time()
        for _ in range(5):
            manifest.save(Path(folder))
        return (time.process_time() - before) / 5
