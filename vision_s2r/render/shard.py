"""One shard: a run of consecutive scenes, rendered in one process and written as one safetensors file."""

import hashlib
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import save_file

from vision_s2r.errors import UserError
from vision_s2r.files import whole
from vision_s2r.render.config import RenderConfig
from vision_s2r.scene import (
    Renderer,
    SceneConfig,
    SceneState,
    attempt,
    canonical,
    nominal_camera,
    propose,
    randomized,
    real,
    sample_state,
    turned,
)
from vision_s2r.scene.config import MAX_OBJECTS


def indices(cfg: RenderConfig, shard: int) -> range:
    """The scene indices of a shard."""
    return range(shard * cfg.shard_size, min((shard + 1) * cfg.shard_size, cfg.scenes))


def render_shard(scene: SceneConfig, cfg: RenderConfig, shard: int) -> dict[str, np.ndarray]:
    """Every tensor of one shard, first axis its N scenes; see the package's docstring."""
    with Renderer(scene) as renderer:
        rows = [render_scene(renderer, state, cfg) for state in states(scene, cfg, shard)]
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def states(scene: SceneConfig, cfg: RenderConfig, shard: int) -> Iterator[SceneState]:
    """The scenes of a shard; with turns, so many in a row are the same settled one, a quarter turn on each."""
    for settled, group in groupby(indices(cfg, shard), lambda i: i // cfg.turns):
        state = sample_state(scene, cfg.seed, settled)
        yield from (state if cfg.turns == 1 else turned(scene, state, i) for i in group)


def render_scene(renderer: Renderer, state: SceneState, cfg: RenderConfig) -> dict[str, np.ndarray]:
    """Pictures, labels, grasps and the state itself of one scene."""
    camera = nominal_camera(renderer.cfg.viewpoint)
    clean = renderer.render(state, canonical(state), cfg.size, labels=True, camera=camera)
    assert clean.depth is not None and clean.segmentation is not None and clean.instance is not None
    row = {
        "canonical": clean.rgb,
        "depth": clean.depth,
        "segmentation": clean.segmentation,
        "instance": clean.instance,
        "intrinsics": camera.intrinsics(cfg.size),
        "extrinsics": camera.extrinsics(),
        **state_arrays(state),
    }
    source_size = cfg.size * cfg.source_scale
    if cfg.views:
        looks = [randomized(renderer.cfg, state, view) for view in range(cfg.views)]
        row["randomized"] = np.stack([renderer.render(state, k, source_size, cfg.margin).rgb for k in looks])
    if cfg.real:
        row["real"] = renderer.render(state, real(renderer.cfg, state), source_size, cfg.margin).rgb
    if cfg.grasps:
        grasps, origins = propose(renderer.cfg, state, cfg.grasps)
        success = [attempt(renderer.cfg, state, grasp).success for grasp in grasps]
        row |= {"grasps": grasps, "origin": origins.astype(np.uint8), "success": np.array(success, np.uint8)}
    return row


def state_arrays(state: SceneState) -> dict[str, np.ndarray]:
    """The state as arrays of fixed size: object ids are -1 where there is no object."""
    ids = np.full(MAX_OBJECTS, -1, np.int64)
    poses = np.zeros((MAX_OBJECTS, 7))
    ids[: len(state.object_ids)] = state.object_ids
    poses[: len(state.object_ids)] = state.object_poses
    return {
        "seed_and_index": np.array([state.seed, state.index], np.int64),
        "object_ids": ids,
        "object_poses": poses,
        "arm_joints": np.array(state.arm_joints),
        "field_of_view": np.array(state.camera.field_of_view),
        "camera_position": np.array(state.camera.position),
        "camera_rotation": np.array(state.camera.rotation),
    }


def write(path: Path, tensors: dict[str, np.ndarray]) -> str:
    """Write the shard, whole or not at all; returns its checksum. Raises UserError where that cannot be."""
    try:
        with whole(path) as temporary:
            save_file({name: np.ascontiguousarray(value) for name, value in tensors.items()}, temporary)
            return checksum(temporary)
    except SafetensorError as error:  # of a full disk, too
        raise UserError(f"{path}: cannot be written ({error})") from error


def checksum(path: Path) -> str:
    """SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
