"""Where a plane of the world appears in a picture, and intrinsics of pictures of another size."""

import torch
from torch import Tensor


def plane_homography(intrinsics: Tensor, extrinsics: Tensor, height: float) -> Tensor:
    """float32 [B, 3, 3]: (x, y, 1) on the world plane z = height to homogeneous pixels.

    intrinsics [B, 4] (fx, fy, cx, cy), extrinsics [B, 4, 4] (world → camera). The third coordinate is the depth
    in metres, so it is positive in front of the camera.
    """
    fx, fy, cx, cy = intrinsics.double()[:, :, None].unbind(1)
    extrinsics = extrinsics.double()
    origin = extrinsics[:, :3, 2] * height + extrinsics[:, :3, 3]
    camera = torch.stack([extrinsics[:, :3, 0], extrinsics[:, :3, 1], origin], -1)  # (x, y, 1) → camera's axes
    x, y, z = camera.unbind(1)
    return torch.stack([fx * x + cx * z, fy * y + cy * z, z], 1).float()


def enlarged(intrinsics: Tensor, factor: float) -> Tensor:
    """Intrinsics [B, 4] (fx, fy, cx, cy) of a picture with `factor` times as many pixels a side.

    Centres of pixels lie at integers.
    """
    return torch.cat([intrinsics[:, :2] * factor, (intrinsics[:, 2:] + 0.5) * factor - 0.5], 1)
