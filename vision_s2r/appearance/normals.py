"""Normals of surfaces, from depth.

The inverse depth of a plane is linear in the picture's coordinates, so that a plane is fitted to it around each pixel,
among pixels of one label. Beside an edge the likeliest of the planes fitted nearby is taken, not the one across it
(Kuwahara et al. 1976).
"""

import torch
import torch.nn.functional as F
from torch import Tensor

_SIDE = 5  # px, of the window that a plane is fitted in
_OFFSETS = (-2, 0, 2)  # px, between a pixel and the windows that it may be of
_LEAST = 7.0  # pixels that make a plane
_ACROSS = 0.05  # relative depth by which a pixel is off the plane of a window that it may be of, at most
_BETTER = 0.25  # times the misfit of the pixel's own window, that another has to have


def normals(depth: Tensor, labels: Tensor, intrinsics: Tensor) -> Tensor:
    """Unit normals [N, 3, H, W], towards the camera, in its axes (x right, y down, z forward); 0 where unknown.

    `depth` [N, H, W] along the optical axis (m, 0 where unknown), `labels` [N, H, W], `intrinsics` fx, fy, cx, cy.
    """
    height, width = depth.shape[-2:]
    fx, fy, cx, cy = intrinsics.double().tolist()
    u = ((torch.arange(width) - cx) / fx).double()[None, :].expand(height, width)
    v = ((torch.arange(height) - cy) / fy).double()[:, None].expand(height, width)
    found = torch.zeros((len(depth), 3, height, width))
    for label in labels.unique().tolist():
        known = (labels == label) & (depth > 0)
        if known.any():
            own = _of_label(depth.double(), known, u, v)
            found = torch.where(known[:, None], own.float(), found)
    return found


def _of_label(depth: Tensor, known: Tensor, u: Tensor, v: Tensor) -> Tensor:
    """Normals [N, 3, H, W] of the pixels that are `known`."""
    inverse = torch.where(known, 1 / depth.clamp(min=1e-6), 0.0)
    typical = inverse[known].mean()
    w = inverse / typical
    mask = known.double()
    one = torch.ones_like(u)
    basis = [u, v, one]
    pairs = {(i, j): _sums(mask * basis[i] * basis[j]) for i in range(3) for j in range(i, 3)}
    matrix = torch.stack([torch.stack([pairs[min(i, j), max(i, j)] for j in range(3)], -1) for i in range(3)], -2)
    vector = torch.stack([_sums(w * each) for each in basis], -1)
    count = pairs[2, 2]
    centres = known & (count >= _LEAST)
    plane = torch.zeros_like(vector)  # [N, H, W, 3]
    misfit = torch.full_like(count, torch.inf)
    own = vector[centres]
    plane[centres] = torch.linalg.solve(matrix[centres] + 1e-12 * torch.eye(3, dtype=torch.float64), own)
    squares = _sums(w * w)[centres] - (plane[centres] * own).sum(-1)
    misfit[centres] = (squares / (count[centres] - 3)).clamp(min=0)
    best, chosen = misfit * _BETTER, plane
    for dy in _OFFSETS:
        for dx in _OFFSETS:
            near, of_near = torch.roll(misfit, (dy, dx), (1, 2)), torch.roll(plane, (dy, dx), (1, 2))
            fits = (of_near[..., 0] * u + of_near[..., 1] * v + of_near[..., 2] - w).abs() < _ACROSS
            better = (near < best) & fits
            best = torch.where(better, near, best)
            chosen = torch.where(better[..., None], of_near, chosen)
    size = chosen.norm(dim=-1, keepdim=True)
    unit = torch.where(size > 0, -chosen / size.clamp(min=1e-12), 0.0)
    return unit.permute(0, 3, 1, 2)


def _sums(values: Tensor) -> Tensor:
    """Sums over the window around each pixel [N, H, W]."""
    return F.avg_pool2d(values[:, None], _SIDE, 1, padding=_SIDE // 2, divisor_override=1)[:, 0]
