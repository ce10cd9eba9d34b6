"""The rows of the table: ways from a picture to a grasp."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vision_s2r.camera.presets import preset_of
from vision_s2r.errors import UserError
from vision_s2r.evaluate.cells import fingerprint
from vision_s2r.evaluate.columns import Column
from vision_s2r.evaluate.config import EvaluateConfig, RowConfig
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.grasp import GraspPolicy
from vision_s2r.images import reduced
from vision_s2r.render.shard import checksum
from vision_s2r.training import checkpoint
from vision_s2r.translate import Translator

BATCH = 64  # scenes at a time
CAMERAS = ("camera", "validation_camera")  # in a configuration: drawn from in training, and that chose the checkpoint


def _device() -> str:
    return "cuda" if torch.cuda.is_available() else "cpu"


def _load_policy(path: str) -> GraspPolicy:
    return GraspPolicy.load(path, _device())


def _load_translator(path: str) -> Translator:
    return Translator.load(path, _device())


@dataclass(frozen=True)
class Loaders:
    """How a checkpoint's path becomes a network."""

    policy: Callable[[str], GraspPolicy] = _load_policy
    translator: Callable[[str], Translator] = _load_translator


@dataclass(frozen=True)
class Runner:
    """One training seed of a row: its networks and where they came from."""

    cfg: RowConfig
    policy: GraspPolicy
    translator: Translator | None
    checkpoints: dict[str, dict[str, Any]]  # "policy", "translator": path, sha256, configuration, training

    @property
    def looks_at_source(self) -> bool:
        """Whether anything of the row depends on the column's pictures."""
        return self.cfg.picture == "source" or self.policy.cfg.with_source

    @property
    def sees_source(self) -> bool:
        """Whether the policy is given the column's pictures as they are."""
        return self.cfg.picture == "source" and self.translator is None

    @property
    def inputs(self) -> list[Any]:
        """JSON-able: what its grasps depend on, apart from scenes and column."""
        networks = {role: known["sha256"] for role, known in self.checkpoints.items()}
        return [self.cfg.picture, networks, *["mirrored"] * self.cfg.mirrored]

    def fingerprint(self, column: Column, scenes: Scenes, seed: int) -> str:
        """Of all that its cell in the column depends on; where it never looks at the column's pictures, not of those.

        `seed`: of the evaluation.
        """
        looks_at = asdict(column) if self.looks_at_source else None
        return fingerprint(looks_at, self.inputs, scenes.inputs, seed)

    def look(self, source: Tensor, canonical: Tensor) -> Tensor:
        """What the policy is given, uint8 [N, H, W, 3], of the column's pictures and the true canonical ones."""
        if self.cfg.picture == "canonical":
            return canonical
        if self.translator is None:
            return reduced(source, self.policy.size)
        return self.translator(reduced(source, self.translator.size), self.cfg.mirrored)

    def act(self, source: Tensor, scenes: Scenes) -> tuple[np.ndarray, np.ndarray]:
        """Grasps float64 [N, 3] and Q of each [N] for the column's pictures of the scenes."""
        pictures = self.look(source, scenes.views.all("canonical"))
        intrinsics, extrinsics = scenes.views.all("intrinsics"), scenes.views.all("extrinsics")
        actions, q = [], []
        for some in torch.arange(len(scenes)).split(BATCH):
            beside = reduced(source[some], self.policy.size) if self.policy.cfg.with_source else None
            seen = pictures[some], intrinsics[some], extrinsics[some], scenes.seeds[some]
            found = self.policy.act(*seen, beside, self.cfg.mirrored)
            actions.append(found.actions)
            q.append(found.q)
        return torch.cat(actions).double().numpy(), torch.cat(q).double().numpy()


def load_rows(cfg: EvaluateConfig, size: int, loaders: Loaders) -> dict[str, list[Runner]]:
    """The rows whose checkpoints are configured, each with a runner for each training seed.

    Raises UserError for a missing or foreign checkpoint, and one that does not fit its row or canonical pictures of
    `size`; source pictures of more pixels are made as small for it.
    """
    rows: dict[str, list[Runner]] = {}
    for name, row in cfg.rows.items():
        if row.present:
            translators: Sequence[str | None] = row.translator or [None] * len(row.policy)
            pairs = zip(row.policy, translators, strict=True)
            rows[name] = [_runner(f"evaluate.rows.{name}", row, *pair, size, loaders) for pair in pairs]
            _require_not_chosen_on(cfg.cameras, rows[name])
    return rows


def _runner(
    where: str, row: RowConfig, policy_path: str, translator_path: str | None, size: int, loaders: Loaders
) -> Runner:
    policy = loaders.policy(policy_path)
    picture = policy.cfg.picture
    if picture != row.trained_on:
        raise UserError(f"{where}: {policy_path} was trained on {picture} pictures: expected {row.trained_on} ones")
    _require_size(where, policy_path, policy.size, size)
    looks_at_source = picture != "canonical" or policy.cfg.with_source
    known = {"policy": _known(policy_path, "q_function", looks_at_source)}
    if translator_path is None:
        return Runner(row, policy, None, known)
    known["translator"] = _known(translator_path, "translator", True)
    translator = loaders.translator(translator_path)
    _require_size(where, translator_path, translator.size, size)
    return Runner(row, policy, translator, known)


def _require_size(where: str, path: str, found: int, size: int) -> None:
    if found != size:
        raise UserError(f"{where}: {path} was trained on pictures of {found} px: the scenes have {size} px")


def _known(path: str, kind: str, looks_at_source: bool) -> dict[str, Any]:
    """What the table says of a checkpoint; it knows cameras only if it was trained on source pictures."""
    found = checkpoint.load(path, kind)
    cameras = {key: found.configuration.get(key) if looks_at_source else None for key in CAMERAS}
    return {
        "path": path,
        "sha256": checksum(found.path),
        "configuration": found.configuration,
        "training": found.training,
        "cameras": {key: preset_of(camera) for key, camera in cameras.items()},
    }


def _require_not_chosen_on(cameras: list[str], runners: list[Runner]) -> None:
    for known in (known for runner in runners for known in runner.checkpoints.values()):
        chosen_by = known["cameras"]["validation_camera"]
        if chosen_by in cameras:
            raise UserError(
                f"{known['path']} was chosen by camera '{chosen_by}', which is a column of the table: "
                "expected a validation camera of its own, or evaluate.cameras without it"
            )
