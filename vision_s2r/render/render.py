"""Render a set of scenes into shards: in parallel, resumable, identical however often it was interrupted."""

import sys
from pathlib import Path

from vision_s2r import parallel
from vision_s2r.errors import UserError
from vision_s2r.progress import tracked
from vision_s2r.render import config, sheet
from vision_s2r.render import shard as shards
from vision_s2r.render.config import RenderConfig
from vision_s2r.render.manifest import NAME, Manifest, shard_path
from vision_s2r.render.store import Store
from vision_s2r.render.views import Views
from vision_s2r.scene import SceneConfig, objects
from vision_s2r.scene import config as scene_config


def render(scene: SceneConfig, cfg: RenderConfig) -> Path:
    """Render what is not yet there into cfg.out; returns that folder, with a contact sheet beside the shards.

    Raises UserError for bad values, a folder that holds another configuration, and a full disk.
    """
    scene_config.check(scene)
    config.check(cfg)
    objects.object_ids(scene.objects.split)
    folder = Path(cfg.out)
    manifest = _begin(folder, Manifest.new(scene, cfg), cfg.store)
    missing = [k for k in range(manifest.shard_count) if k not in manifest.checksums]
    if missing:
        _render_missing(scene, cfg, folder, manifest, missing)
        sheet.write(Views.open(folder), folder / "contact_sheet.png")
    print(f"{cfg.scenes} scenes in {folder}, contact sheet {folder / 'contact_sheet.png'}", file=sys.stderr)
    return folder


def _begin(folder: Path, wanted: Manifest, store: str) -> Manifest:
    """The folder's manifest, less its damaged shards, or a new one."""
    folder.mkdir(parents=True, exist_ok=True)
    if store:
        Store(store).fetch(folder)
    if not (folder / NAME).exists():
        wanted.save(folder)
        return wanted
    manifest = Manifest.load(folder)
    manifest.require_same(wanted, folder)
    for path in manifest.damaged(folder):
        print(f"{path} is damaged or missing: it is rendered again", file=sys.stderr)
        number = next(k for k in manifest.checksums if shard_path(folder, k) == path)
        del manifest.checksums[number]
    return manifest


def _render_missing(
    scene: SceneConfig, cfg: RenderConfig, folder: Path, manifest: Manifest, missing: list[int]
) -> None:
    store = Store(cfg.store) if cfg.store else None
    calls = ((scene, cfg, folder, k) for k in missing)
    done = parallel.run(_one, calls, cfg.workers, cfg.backend, ordered=False)
    try:
        for number, digest in tracked(done, manifest.shard_count, "shards", len(manifest.checksums)):
            manifest.checksums[number] = digest
            manifest.save(folder)
            if store:
                store.push(folder / NAME)
        if store:
            store.complete(folder, manifest)
    except OSError as error:
        raise UserError(f"cannot write to {folder}: {error.strerror or error}; the same command goes on") from error


def _one(scene: SceneConfig, cfg: RenderConfig, folder: Path, number: int) -> tuple[int, str]:
    path = shard_path(folder, number)
    digest = shards.write(path, shards.render_shard(scene, cfg, number))
    if cfg.store:
        Store(cfg.store).push(path)
    return number, digest
