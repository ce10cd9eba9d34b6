"""Views in which whether a grasp succeeds has a rule: a bright bar on a plane, seen through a tilted pinhole camera."""

import math

import torch
from torch import Tensor

from vision_s2r.scene import CLASSES

OBJECT = CLASSES.index("object")
SIZE, MARGIN, GRASPS = 40, 2, 8
AREA = 0.08  # m, half a side
LENGTH, WIDTH = 0.1, 0.03  # m, of the bar
FLOOR = 0.1  # m, half a side: beyond it the plane is dark, so that pictures show where their camera looks


def camera(scenes: int, generator: torch.Generator, size: int = SIZE) -> tuple[Tensor, Tensor]:
    """Intrinsics [N, 4] and extrinsics [N, 4, 4] of cameras some 0.5 m over the plane, each tilted another way."""
    tilt, around = 0.35 * torch.rand(scenes, generator=generator), 6.28 * torch.rand(scenes, generator=generator)
    away = torch.stack([torch.sin(tilt) * torch.cos(around), torch.sin(tilt) * torch.sin(around), torch.cos(tilt)], 1)
    forward = -away
    right = torch.linalg.cross(forward, torch.tensor([0.0, 1.0, 0.0]).expand(scenes, 3))
    right = right / right.norm(dim=1, keepdim=True)
    rotation = torch.stack([right, torch.linalg.cross(forward, right), forward], 1).double()
    extrinsics = torch.eye(4, dtype=torch.float64).repeat(scenes, 1, 1)
    extrinsics[:, :3, :3] = rotation
    extrinsics[:, 2, 3] = 0.5 + 0.05 * torch.rand(scenes, generator=generator, dtype=torch.float64)
    intrinsics = torch.tensor([2.3 * size, 2.3 * size, (size - 1) / 2, (size - 1) / 2], dtype=torch.float64)
    return intrinsics.repeat(scenes, 1), extrinsics


def on_plane(intrinsics: Tensor, extrinsics: Tensor, size: int, margin: int) -> Tensor:
    """World (x, y) on z = 0 that each pixel of the picture with its margin sees: [N, S, S, 2]."""
    at = torch.arange(-margin, size + margin, dtype=torch.float64)
    v, u = torch.meshgrid(at, at, indexing="ij")
    fx, fy, cx, cy = intrinsics[:, :, None, None].unbind(1)
    rays = torch.stack([(u - cx) / fx, (v - cy) / fy, torch.ones_like(u).expand(len(fx), -1, -1)], -1)
    rotation, translation = extrinsics[:, :3, :3], extrinsics[:, :3, 3]
    rays = torch.einsum("nji,nhwj->nhwi", rotation, rays)
    centre = -torch.einsum("nji,nj->ni", rotation, translation)[:, None, None]
    return (centre - rays * centre[..., 2:] / rays[..., 2:])[..., :2]


class Bars:
    """Scenes of one bar each; a grasp succeeds on its middle line, away from its ends, closing across it."""

    size, source_size, margin = SIZE, SIZE, MARGIN

    def __init__(self, scenes: int, seed: int):
        generator = torch.Generator().manual_seed(seed)

        def uniform(*shape: int) -> Tensor:
            return 2 * torch.rand(*shape, generator=generator) - 1

        self.place, self.angle = 0.04 * uniform(scenes, 2), math.pi / 2 * uniform(scenes)
        intrinsics, extrinsics = camera(scenes, generator)
        seen = on_plane(intrinsics, extrinsics, SIZE, MARGIN).float()
        along, across = self._in_bar(seen.flatten(1, 2))
        bar = ((along.abs() < LENGTH / 2) & (across.abs() < WIDTH / 2)).view(seen.shape[:3])
        wide = torch.where(bar[..., None], torch.tensor([220, 180, 60]), torch.tensor([70, 70, 80])).to(torch.uint8)
        wide[seen.abs().amax(-1) > FLOOR] = torch.tensor([20, 20, 30], dtype=torch.uint8)
        near = uniform(scenes, GRASPS, 2) * torch.tensor([LENGTH / 2, 0.02])
        near[:, ::2] = 0.06 * uniform(scenes, GRASPS // 2, 2)
        turn = torch.stack([torch.cos(self.angle), torch.sin(self.angle)], 1)[:, None]
        x = near[..., 0] * turn[..., 0] - near[..., 1] * turn[..., 1]
        y = near[..., 0] * turn[..., 1] + near[..., 1] * turn[..., 0]
        yaw = self.angle[:, None] + math.pi / 2 + math.pi / 2 * uniform(scenes, GRASPS)
        yaw = torch.remainder(yaw + math.pi / 2, math.pi) - math.pi / 2
        grasps = torch.stack([x + self.place[:, :1], y + self.place[:, 1:], yaw], -1)
        self.tensors = {
            "canonical": wide[:, MARGIN:-MARGIN, MARGIN:-MARGIN],
            "segmentation": OBJECT * bar[:, MARGIN:-MARGIN, MARGIN:-MARGIN].to(torch.uint8),
            "depth": 0.5 + 0.1 * bar[:, MARGIN:-MARGIN, MARGIN:-MARGIN],
            "randomized": wide[:, None],
            "real": wide,
            "intrinsics": intrinsics,
            "extrinsics": extrinsics,
            "field_of_view": 2 * torch.atan(SIZE / 2 / intrinsics[:, 0]),
            "camera_position": -(extrinsics[:, :3, :3].mT @ extrinsics[:, :3, 3:])[..., 0],
            "camera_rotation": extrinsics[:, :3, :3],
            "grasps": grasps,
            "success": self.succeeds(grasps).to(torch.uint8),
        }
        self.names = set(self.tensors)

    def __len__(self) -> int:
        return len(self.place)

    def batch(self, name: str, indices: Tensor) -> Tensor:
        return self.tensors[name][indices]

    def succeeds(self, grasps: Tensor) -> Tensor:
        """Whether grasps [N, K, 3], K in each scene, succeed: bool [N, K]."""
        along, across = self._in_bar(grasps[..., :2])
        crossing = torch.sin(grasps[..., 2] - self.angle[:, None]).abs() > math.cos(0.6)
        return crossing & (along.abs() < LENGTH / 2 - 0.01) & (across.abs() < WIDTH / 2)

    def _in_bar(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Along and across the bar, metres, of points [N, K, 2]."""
        x, y = (points - self.place[:, None]).unbind(-1)
        cos, sin = torch.cos(self.angle)[:, None], torch.sin(self.angle)[:, None]
        return x * cos + y * sin, y * cos - x * sin
