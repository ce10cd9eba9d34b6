"""How much a translation changes what the policy thinks of grasps."""

import torch
from torch import Tensor

from vision_s2r.evaluate.rows import Runner
from vision_s2r.evaluate.scenes import Scenes
from vision_s2r.grasp.geometry import random_grasps
from vision_s2r.images import reduced

GRASPS = 64  # drawn uniformly, the same in every scene
SEED = 0  # of that draw


class QDifference:
    """Mean absolute difference of Q (chances of success) between a translation and the true canonical picture.

    Over the same grasps in all columns: GRASPS uniform ones over the policy's search area and all yaws, and the one
    that the policy finds best on the canonical picture; each counts the same. (RL-CycleGAN's consistency of Q, Rao et
    al. 2020, arXiv:2006.09001, as a measure.)
    """

    def __init__(self, scenes: Scenes) -> None:
        views = scenes.views
        self._scenes, self._canonical = scenes, views.all("canonical")
        self._cameras = views.all("intrinsics"), views.all("extrinsics")
        self._known: dict[str, tuple[Tensor, Tensor]] = {}  # by policy, of those that see no source

    def __call__(self, runner: Runner, translated: Tensor, source: Tensor) -> Tensor:
        """[N], one a scene: of `translated` against canonical pictures; `source` is what was translated.

        Pictures are uint8 [N, H, W, 3].
        """
        beside = reduced(source, runner.policy.size) if runner.policy.cfg.with_source else None
        grasps, true = self._reference(runner, beside)
        q = runner.policy.score(translated, *self._cameras, grasps, beside)
        return (q - true).abs().mean(1)

    def _reference(self, runner: Runner, beside: Tensor | None) -> tuple[Tensor, Tensor]:
        """The grasps [N, K, 3], and their Q [N, K] on the canonical pictures."""
        key = runner.checkpoints["policy"]["sha256"]
        if beside is None and key in self._known:
            return self._known[key]
        policy = runner.policy
        best = policy.act(self._canonical, *self._cameras, self._scenes.seeds, beside).actions
        uniform = random_grasps(1, GRASPS, policy.cfg.area, torch.Generator().manual_seed(SEED))
        uniform = uniform.expand(len(best), -1, -1)
        grasps = torch.cat([uniform, best[:, None]], 1)
        known = grasps, policy.score(self._canonical, *self._cameras, grasps, beside)
        if beside is None:
            self._known[key] = known
        return known
