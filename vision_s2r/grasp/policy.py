"""A trained grasp policy, which is all that another program needs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vision_s2r.errors import UserError
from vision_s2r.grasp import cem, geometry
from vision_s2r.grasp.config import GraspConfig
from vision_s2r.grasp.forms import load_q
from vision_s2r.grasp.method import beside
from vision_s2r.grasp.q_function import QFunction
from vision_s2r.images import to_float


@dataclass(frozen=True)
class Grasps:
    """What a policy chose, one a picture, on the CPU."""

    actions: Tensor  # float32 [B, 3]: x, y (m), yaw (rad) in [-pi/2, pi/2)
    q: Tensor  # float32 [B]: chance of success that Q gives them


class GraspPolicy:
    """Pictures of bins to grasps: `GraspPolicy.load(path).act(canonical, intrinsics, extrinsics, seeds)`."""

    def __init__(self, q_function: QFunction, cfg: GraspConfig, size: int, device: str | torch.device = "cpu"):
        """`size`: side of the pictures that Q was trained on, px."""
        self.cfg, self.size = cfg, size
        self._device = torch.device(device)
        self._q = q_function.to(self._device).eval().requires_grad_(False)

    @classmethod
    def load(cls, path: str | Path, device: str | torch.device = "cpu") -> "GraspPolicy":
        """The policy of a released checkpoint. Raises UserError where the file is none."""
        return cls(*load_q(path), device)

    @torch.no_grad()
    def act(
        self,
        canonical: Tensor,
        intrinsics: Tensor,
        extrinsics: Tensor,
        seeds: Tensor,
        source: Tensor | None = None,
        mirrored: bool = False,
    ) -> Grasps:
        """The best grasp that the search finds in each picture.

        canonical: uint8 [B, H, W, 3] or float [B, 3, H, W] in [0, 1]; intrinsics [B, 4] and extrinsics [B, 4, 4] of
        its camera; seeds: int [B], of each scene's search, whose result does not depend on the others in the batch;
        source: the picture it was made from, if and only if the policy was trained with it; mirrored: whether the
        search is over the mean of Q's logits of the picture and of its mirror image, for twice the time.
        Raises UserError for anything else.
        """
        images = self._images(canonical, source)
        _require_shapes(len(images), intrinsics=(intrinsics, 4), extrinsics=(extrinsics, 4, 4), seeds=(seeds,))
        given = images, intrinsics, extrinsics, seeds
        parts = zip(*(t.split(self.cfg.cem.scenes) for t in given), strict=True)
        actions, q = zip(*(self._search(*part, mirrored=mirrored) for part in parts), strict=True)
        return Grasps(torch.cat(actions).cpu(), torch.cat(q).sigmoid().cpu())

    @torch.no_grad()
    def score(
        self,
        canonical: Tensor,
        intrinsics: Tensor,
        extrinsics: Tensor,
        grasps: Tensor,
        source: Tensor | None = None,
    ) -> Tensor:
        """Q of given grasps, float32 [B, K, 3] (x, y in metres, yaw in radians), in each picture.

        Chances of success, float32 [B, K] on the CPU. The rest is as for `act`, and so are its errors.
        """
        images = self._images(canonical, source)
        given = (grasps, *grasps.shape[1:2], 3)
        _require_shapes(len(images), intrinsics=(intrinsics, 4), extrinsics=(extrinsics, 4, 4), grasps=given)
        parts = zip(*(t.split(self.cfg.cem.scenes) for t in (images, intrinsics, extrinsics, grasps)), strict=True)
        return torch.cat([self._q(*(t.to(self._device) for t in part)).logits.sigmoid().cpu() for part in parts])

    def _images(self, canonical: Tensor, source: Tensor | None) -> Tensor:
        """What Q is given, float32 [B, C, H, W]."""
        if (source is not None) != self.cfg.with_source:
            expected, found = ("with", "none") if self.cfg.with_source else ("without", "one")
            raise UserError(f"policy: trained {expected} source pictures (grasp.with_source), but given {found}")
        return beside(
            self._picture(canonical, "canonical"), None if source is None else self._picture(source, "source")
        )

    def _search(
        self, images: Tensor, intrinsics: Tensor, extrinsics: Tensor, seeds: Tensor, *, mirrored: bool
    ) -> tuple[Tensor, Tensor]:
        seen = [each.to(self._device) for each in (images, intrinsics, extrinsics)]
        encoding = self._q.encode(*seen)
        other = self._q.encode(*geometry.mirrored(*seen)) if mirrored else None

        def score(grasps: Tensor) -> Tensor:
            logits = self._q.score(encoding, grasps)
            return logits if other is None else (logits + self._q.score(other, geometry.mirrored_grasps(grasps))) / 2

        return cem.maximize(score, seeds.tolist(), self.cfg.area, self.cfg.cem, self._device)

    def _picture(self, picture: Tensor, name: str) -> Tensor:
        """Either form as float32 [B, 3, H, W]."""
        if not isinstance(picture, Tensor):
            raise UserError(f"policy: {name} pictures are a {type(picture).__name__}: expected a torch.Tensor")
        what = f"policy: {name} pictures of type {picture.dtype} and shape {tuple(picture.shape)}"
        shape = (self.size, self.size, 3) if picture.dtype == torch.uint8 else (3, self.size, self.size)
        if not (picture.dtype == torch.uint8 or picture.is_floating_point()) or not len(picture):
            raise UserError(f"{what}: expected uint8 [B, H, W, 3], or float [B, 3, H, W] in [0, 1]")
        if picture.shape[1:] != shape:
            raise UserError(f"{what}: expected {('B', *shape)}, the size it was trained on")
        if picture.dtype == torch.uint8:
            return to_float(picture)
        if not (picture.amin() >= 0 and picture.amax() <= 1):
            raise UserError(f"{what} with values outside [0, 1]: expected [0, 1], or uint8 [B, H, W, 3]")
        return picture.float()


def _require_shapes(count: int, **given: Any) -> None:
    """Of each tensor by name, followed by all sides but the first, which is `count`."""
    for name, (tensor, *sides) in given.items():
        if tensor.shape != (count, *sides):
            raise UserError(f"policy: {name} of shape {tuple(tensor.shape)}: expected {(count, *sides)}")
