"""A trained policy, frozen, on translations: how much do they differ to Q from the true canonical pictures?"""

from pathlib import Path

import torch
from torch import Tensor

from vision_s2r.errors import UserError
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.forms import load_q
from vision_s2r.grasp.geometry import random_grasps
from vision_s2r.grasp.metrics import measure
from vision_s2r.grasp.q_function import Encoding, QFunction

GRASPS = 8  # a picture, at which activations are compared


class FrozenQ:
    """A frozen Q-function; gradients pass it on their way to the pictures.

    Pictures are float [B, 3, H, W] in [0, 1], intrinsics [B, 4] and extrinsics [B, 4, 4] those of the canonical camera,
    grasps [B, K, 3] (x, y, yaw). It works where the pictures are.
    """

    def __init__(self, q_function: QFunction, cfg: GraspConfig, size: int):
        """`size`: side of the pictures that Q was trained on, px."""
        self.size = size
        self._q = q_function.eval().requires_grad_(False)
        self._area = cfg.area

    @classmethod
    def load(cls, path: str | Path) -> "FrozenQ":
        """The Q-function of a released policy. Raises UserError where the file is none, or Q sees source pictures."""
        q_function, cfg, size = load_q(path)
        if cfg.picture != "canonical" or cfg.with_source:
            raise UserError(f"{path}: its policy looks at source pictures: expected one of canonical pictures alone")
        return cls(q_function, cfg, size)

    def grasps(self, count: int, generator: torch.Generator) -> Tensor:
        """Random grasps [count, K, 3] on the CPU, uniform over the search area and all yaws."""
        return random_grasps(count, GRASPS, self._area, generator)

    def activations(self, pictures: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> list[Tensor]:
        """What Q makes of the pictures at the grasps, layer by layer."""
        return self._q.perceive(self._encode(pictures, intrinsics, extrinsics), grasps)

    def logits(self, pictures: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> Tensor:
        """Logits [B, K] of the chance that each grasp succeeds."""
        return self._q.score(self._encode(pictures, intrinsics, extrinsics), grasps)

    def _encode(self, pictures: Tensor, intrinsics: Tensor, extrinsics: Tensor) -> Encoding:
        return self._q.to(pictures.device).encode(pictures.float(), intrinsics, extrinsics)

    @staticmethod
    def measure(translated: Tensor, true: Tensor, success: Tensor) -> dict[str, float]:
        """Of the logits [N, K] of the same grasps in translated and true canonical pictures, and labels [N, K] (0, 1).

        `q_difference`: mean absolute difference of the chances. `auc`: how well those of translated pictures foretell
        the labels (`vision_s2r.grasp.metrics`).
        """
        difference = (translated.sigmoid() - true.sigmoid()).abs().mean()
        return {"q_difference": float(difference), "auc": measure(translated, success)["auc"]}
