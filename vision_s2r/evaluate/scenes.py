"""The test scenes: rendered, of objects that no training saw, and the same in every cell."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch

from vision_s2r.errors import UserError
from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.render import Views
from vision_s2r.scene import SceneConfig, SceneState

SPLIT = "test"


@dataclass(frozen=True)
class Scenes:
    """N scenes: their pictures, their states, and a seed for the policy's search in each."""

    cfg: SceneConfig
    views: Views
    states: list[SceneState]
    seeds: torch.Tensor  # int64 [N]

    def __len__(self) -> int:
        return len(self.states)

    @property
    def inputs(self) -> list[Any]:
        """JSON-able: which scenes they are, and in what world grasps are tried."""
        manifest = self.views.manifest
        return [len(self), manifest.checksums, asdict(self.cfg.physics), self.cfg.objects.scale]

    @classmethod
    def open(cls, cfg: EvaluateConfig, scene_cfg: SceneConfig) -> "Scenes":
        """The first `cfg.limit` scenes (0: all) of the folder `cfg.scenes`.

        Raises UserError where they show training objects, lack pictures, or were rendered of another physics.
        """
        views = Views.open(cfg.scenes)
        split = views.manifest.scene["objects"]["split"]
        if split != SPLIT:
            raise UserError(
                f"{cfg.scenes} shows objects of the split '{split}': a transfer table is of unseen objects, "
                f"render with scene.objects.split={SPLIT}"
            )
        for name, key in (("real", "real=true"), ("randomized", "views=1")):
            if name not in views.names:
                raise UserError(f"{cfg.scenes} holds no {name} pictures: render it with render.{key}")
        _require_same_physics(views, scene_cfg, cfg.scenes)
        if cfg.limit > len(views):
            raise UserError(f"evaluate.limit = {cfg.limit}: {cfg.scenes} has {len(views)} scenes")
        views = views.subset(range(cfg.limit or len(views)))
        states = views.states()
        return cls(scene_cfg, views, states, torch.tensor([_seed(cfg.seed, state) for state in states]))


def _require_same_physics(views: Views, cfg: SceneConfig, folder: str) -> None:
    ours = asdict(cfg)["physics"] | {"objects.scale": cfg.objects.scale}
    theirs = views.manifest.scene["physics"] | {"objects.scale": views.manifest.scene["objects"]["scale"]}
    for key, value in ours.items():
        if theirs.get(key) != value:
            name = key if "." in key else f"physics.{key}"
            raise UserError(
                f"{folder} was rendered with scene.{name} = {theirs.get(key)}, not {value}: "
                "expected grasps to be tried in the world in which the scenes settled"
            )


def _seed(seed: int, state: SceneState) -> int:
    return int(np.random.SeedSequence([seed, state.seed, state.index]).generate_state(1)[0]) >> 1
