"""Where the pixels of a canonical view stand in the picture that a scene's own camera took of the same scene.

It is known in training: the scene says how its camera departs from the nominal one, and the camera effects' parameters
how the picture was bent. It is what the rectifier in front of the U-Net learns to see.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera import CameraParameters
from vision_s2r.geometry import plane_homography

PLANE = 0.02  # m over the bin's floor: exact there, off by a tenth of the displacement for the highest objects
SOURCES = ("intrinsics", "extrinsics", "field_of_view", "camera_position", "camera_rotation")


def displacements(batch: Mapping[str, Tensor], parameters: CameraParameters, size: int, points: int) -> Tensor:
    """What to add to a canonical pixel's place to get its place in the source picture, float32 [B, 2, points, points].

    Right and down, in halves of the picture's side, for pixels on a grid from corner to corner. `batch` holds SOURCES
    as `vision_s2r.render` names them, intrinsics and extrinsics being the canonical view's; `parameters` are those of
    the camera that the source picture passed.
    """
    intrinsics, extrinsics, field_of_view, position, rotation = (batch[name].double().cpu() for name in SOURCES)
    pixels = _grid(size, points)
    plane = torch.linalg.inv(plane_homography(intrinsics, extrinsics, PLANE).double()) @ pixels
    world = torch.cat([plane[:, :2] / plane[:, 2:], torch.full_like(plane[:, :1], PLANE)], 1)
    rays = rotation @ (world - position[:, :, None])
    focal, centre = intrinsics[:, :2, None], intrinsics[:, 2:, None]
    zoom = size / 2 / torch.tan(field_of_view / 2)[:, None, None] / focal  # of the scene's own camera
    rays = torch.cat([zoom * rays[:, :2] / rays[:, 2:], torch.ones_like(rays[:, :1])], 1)
    rays = _rotation(parameters) @ rays
    seen = focal * _bent(rays[:, :2] / rays[:, 2:], parameters) + centre
    return ((seen - pixels[:2]) * 2 / size).float().view(-1, 2, points, points)


def loss(found: Tensor, truth: Tensor) -> Tensor:
    """Absolute error of displacements after each look [B, looks, 2, P, P], in tenths of half the picture's side."""
    return 10 * (found - truth[:, None]).abs().mean()


def error(found: Tensor, truth: Tensor, size: int) -> Tensor:
    """Mean distance [B] of displacements [B, looks, 2, P, P] after the last look, pixels of a picture of `size`."""
    return (found[:, -1] - truth).norm(dim=1).mean((1, 2)) * size / 2


def _grid(size: int, points: int) -> Tensor:
    """Homogeneous pixels [3, points²], rows first."""
    places = torch.linspace(0, size - 1, points, dtype=torch.float64)
    down, right = torch.meshgrid(places, places, indexing="ij")
    return torch.stack([right.flatten(), down.flatten(), torch.ones(points**2, dtype=torch.float64)])


def _rotation(parameters: CameraParameters) -> Tensor:
    """The camera_pose_offset [B, 3, 3], the identity where there is none."""
    zero = torch.zeros(len(parameters), dtype=torch.float64)
    values = parameters.values.get("camera_pose_offset", {})
    pitch, yaw, roll = (values.get(name, zero) for name in ("pitch", "yaw", "roll"))
    skew = torch.stack([zero, -roll, yaw, roll, zero, -pitch, -yaw, pitch, zero], dim=-1)
    return torch.linalg.matrix_exp(skew.reshape(-1, 3, 3))


def _bent(points: Tensor, parameters: CameraParameters) -> Tensor:
    """Normalized places [B, 2, N] through the lens_distortion."""
    zero = torch.zeros(len(parameters), dtype=torch.float64)
    values = parameters.values.get("lens_distortion", {})
    k1, k2 = (values.get(name, zero)[:, None, None] for name in ("k1", "k2"))
    squared = points.square().sum(1, keepdim=True)
    return points * (1 + k1 * squared + k2 * squared.square())
