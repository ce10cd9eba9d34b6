"""Reading rendered shards: memory-mapped, checked against their checksums before anything is trained on them."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
from safetensors import safe_open

from vision_s2r.errors import UserError, nearest
from vision_s2r.render.manifest import Manifest, shard_path
from vision_s2r.scene import Pinhole, SceneState


class Views:
    """Rendered scenes, in order; tensors are read from disk when asked for."""

    def __init__(self, shards: list[dict[str, torch.Tensor]], indices: torch.Tensor, manifest: Manifest) -> None:
        self._shards = shards
        self._indices = indices
        self.manifest = manifest

    @classmethod
    def open(cls, folder: Path | str) -> "Views":
        """The scenes of a folder that `vision-s2r render` finished.

        Raises UserError where shards are missing or damaged, naming the first.
        """
        folder = Path(folder)
        manifest = Manifest.load(folder)
        count, scenes, most = manifest.shard_count, manifest.render["scenes"], manifest.render["shard_size"]
        missing = count - sum(k < count for k in manifest.checksums)
        if missing:
            raise UserError(f"{folder} is not finished, {missing} shards missing: run `vision-s2r render` again")
        for path in manifest.damaged(folder):
            raise UserError(f"{path} is damaged or missing: run `vision-s2r render` again to mend it")
        shards = [_mapped(shard_path(folder, k)) for k in range(count)]
        for k, shard in enumerate(shards):
            rows, expected = {len(each) for each in shard.values()}, min(most, scenes - k * most)
            if rows != {expected}:
                raise UserError(f"{shard_path(folder, k)}: {sorted(rows)} scenes, expected {expected} by the manifest")
        return cls(shards, torch.arange(scenes), manifest)

    def __len__(self) -> int:
        return len(self._indices)

    @property
    def size(self) -> int:
        """Side of a canonical picture, pixels."""
        return int(self.manifest.render["size"])

    @property
    def source_size(self) -> int:
        """Side of a source picture without its margin, pixels."""
        return self.size * int(self.manifest.render["source_scale"])

    @property
    def margin(self) -> int:
        """Pixels of its own around a source picture on each side."""
        return int(self.manifest.render["margin"])

    @property
    def names(self) -> set[str]:
        """The tensors there are."""
        return set(self._shards[0])

    def batch(self, name: str, indices: torch.Tensor) -> torch.Tensor:
        """Rows `indices` [B] of a tensor, [B, ...]. Raises UserError where it was not rendered."""
        if name not in self.names:
            raise UserError(f"these renders hold no '{name}': {nearest(name, self.names)}")
        per_shard = int(self.manifest.render["shard_size"])
        rows = self._indices[indices]
        return torch.stack([self._shards[r // per_shard][name][r % per_shard] for r in rows.tolist()])

    def all(self, name: str) -> torch.Tensor:
        """The whole tensor, [len(self), ...]."""
        return self.batch(name, torch.arange(len(self)))

    def subset(self, indices: torch.Tensor | Iterable[int]) -> "Views":
        """Some of the scenes, in the given order."""
        chosen = torch.as_tensor(list(indices) if not isinstance(indices, torch.Tensor) else indices)
        return Views(self._shards, self._indices[chosen], self.manifest)

    def states(self) -> list[SceneState]:
        """The scene states, bit for bit as they were rendered."""
        names = (
            "seed_and_index",
            "object_ids",
            "object_poses",
            "arm_joints",
            "field_of_view",
            "camera_position",
            "camera_rotation",
        )
        columns = [self.all(name).numpy() for name in names]
        return [_state(*row) for row in zip(*columns, strict=True)]


def _mapped(path: Path) -> dict[str, torch.Tensor]:
    with safe_open(path, framework="pt") as file:
        return {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping


def _state(
    seed_and_index: np.ndarray,
    object_ids: np.ndarray,
    object_poses: np.ndarray,
    arm_joints: np.ndarray,
    field_of_view: np.ndarray,
    camera_position: np.ndarray,
    camera_rotation: np.ndarray,
) -> SceneState:
    count = int((object_ids >= 0).sum())
    x, y, z = camera_position.tolist()
    rotation = tuple(map(tuple, camera_rotation.tolist()))
    return SceneState(
        seed=int(seed_and_index[0]),
        index=int(seed_and_index[1]),
        object_ids=tuple(object_ids[:count].tolist()),
        object_poses=tuple(map(tuple, object_poses[:count].tolist())),
        arm_joints=tuple(arm_joints.tolist()),
        camera=Pinhole(float(field_of_view), (x, y, z), rotation),
    )
