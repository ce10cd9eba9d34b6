"""Where a grasp appears in a picture: a plane over the bin's floor, its pixels, and the grasp's own frame on it.

A grasp is (x, y, yaw): metres and radians of the world; the fingers close along (cos yaw, sin yaw).
"""

import math
from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor

NEAREST = 1e-3  # m in front of the camera: points behind it are taken to be there


def wrap(yaw: Tensor) -> Tensor:
    """Yaw in [-pi/2, pi/2): a parallel jaw is the same half a turn on."""
    return torch.remainder(yaw + math.pi / 2, math.pi) - math.pi / 2


def mirrored(images: Tensor, intrinsics: Tensor, extrinsics: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Pictures [B, C, H, W] and their cameras as a mirror at the plane x = 0 of the world shows them."""
    intrinsics = intrinsics.clone()
    intrinsics[:, 2] = images.shape[-1] - 1 - intrinsics[:, 2]
    sign = extrinsics.new_tensor([-1, 1, 1, 1])
    return images.flip(-1), intrinsics, sign[:, None] * extrinsics * sign


def mirrored_grasps(grasps: Tensor) -> Tensor:
    """Grasps [..., 3] in that mirror; a gripper is its own mirror image."""
    return torch.stack([-grasps[..., 0], grasps[..., 1], wrap(-grasps[..., 2])], -1)


def random_grasps(scenes: int, count: int, area: Sequence[float], generator: torch.Generator | None = None) -> Tensor:
    """Grasps [scenes, count, 3] on the CPU, uniform over |x| ≤ area[0], |y| ≤ area[1] (m) and all yaws."""
    half = torch.tensor([*area, math.pi / 2])
    return (2 * torch.rand(scenes, count, 3, generator=generator) - 1) * half


# The sums below are written out because autocast would do matrix products in bfloat16: pixels off by a quarter.
def project(homography: Tensor, points: Tensor) -> Tensor:
    """Pixels [B, ..., 2] of points [B, ..., 2] on the homography's plane; centres of pixels are whole numbers."""
    image = _apply(homography, points[..., :1], points[..., 1:], 1.0)
    return image[..., :2] / image[..., 2:].clamp_min(NEAREST)


def closing_line(homography: Tensor, grasps: Tensor) -> Tensor:
    """[B, K, 2]: how far a grasp's place in the picture moves along its closing axis, pixels a metre."""
    x, y, yaw = grasps.float()[..., None].unbind(-2)
    place = _apply(homography, x, y, 1.0)
    step = _apply(homography, torch.cos(yaw), torch.sin(yaw), 0.0)
    depth = place[..., 2:].clamp_min(NEAREST)
    return (step[..., :2] - place[..., :2] / depth * step[..., 2:]) / depth


def _apply(homography: Tensor, x: Tensor, y: Tensor, w: float) -> Tensor:
    """The homographies [B, 3, 3] of (x, y, w): [B, ..., 3] of x and y [B, ..., 1]."""
    h = homography.reshape(-1, *[1] * (x.ndim - 2), 3, 3)
    return h[..., 0] * x + h[..., 1] * y + h[..., 2] * w


def sample(features: Tensor, pixels: Tensor) -> Tensor:
    """Bilinear samples [B, C, h, w] of features [B, C, H, W] at pixels [B, h, w, 2]; outside, the edge goes on."""
    height, width = features.shape[-2:]
    grid = (2 * pixels + 1) / pixels.new_tensor([width, height]) - 1
    return F.grid_sample(features.float(), grid, padding_mode="border", align_corners=False)


def window_points(grasps: Tensor, window: tuple[float, float], shape: tuple[int, int]) -> Tensor:
    """World points [B, K, rows, columns, 2] of a window on each grasp, metres; yaw and yaw + pi give the same.

    `window` = (along the closing axis, across it) in metres, `shape` = (rows, columns). Columns go along the
    closing axis; rows go down, so at yaw 0 the window lies like a map: x right, y up.
    """
    rows, columns = shape
    along = ((torch.arange(columns, device=grasps.device) + 0.5) / columns - 0.5) * window[0]
    across = (0.5 - (torch.arange(rows, device=grasps.device) + 0.5) / rows) * window[1]
    v, u = torch.meshgrid(across, along, indexing="ij")
    x, y, yaw = grasps.float()[..., None, None].unbind(2)
    cos, sin = torch.cos(wrap(yaw)), torch.sin(wrap(yaw))
    return torch.stack([x + u * cos - v * sin, y + u * sin + v * cos], -1)
