"""Normals of surfaces, from depth.

The inverse depth of a plane is linear in the picture's coordinates, and that of a small patch of anything smooth is
nearly quadratic. Both are fitted around each pixel, among pixels of one label. Beside an edge the likeliest of the
patches fitted nearby is taken, not the one across it (Kuwahara et al. 1976).
"""

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor

_POWERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))  # of x and y, in a patch's terms
_SPARE = 4.0  # pixels that make a patch, beyond its terms
_ACROSS = 0.05  # relative depth by which a pixel is off a patch that it may be of, at most
_BESIDE = 0.25  # times the misfit of a patch about the pixel itself, that one beside it has to have


@dataclass(frozen=True)
class _Kind:
    """Patches of one size and form, and how much larger than a small plane's their misfit may be to be taken."""

    reach: int  # px, to either side, and from the middle to a pixel that it may be taken for
    terms: int  # 3: a plane, 6: curved
    favour: float

    @property
    def order(self) -> int:
        """Of the patch in x and y."""
        return sum(_POWERS[self.terms - 1])


_KINDS = (_Kind(2, 3, 1.0), _Kind(2, 6, 0.5), _Kind(6, 3, 2.0))


def normals(depth: Tensor, labels: Tensor, intrinsics: Tensor) -> Tensor:
    """Unit normals [N, 3, H, W], towards the camera, in its axes (x right, y down, z forward); 0 where unknown.

    `depth` [N, H, W] along the optical axis (m, 0 where unknown), `labels` [N, H, W], `intrinsics` fx, fy, cx, cy.
    """
    height, width = depth.shape[-2:]
    fx, fy, cx, cy = intrinsics.double().tolist()
    x = (torch.arange(width) - cx).double()[None, :].expand(height, width)
    y = (torch.arange(height) - cy).double()[:, None].expand(height, width)
    rounding = _step(depth) ** 2 / 12
    found = torch.zeros((len(depth), 3, height, width))
    for label in labels.unique().tolist():
        known = (labels == label) & (depth > 0)
        if known.any():
            surface, fits = _surface(depth.double(), known, rounding)
            level, along_x, along_y = surface.unbind(-1)
            # Of a plane a·u + b·v + c = 1 / depth, with u and v at unit distance, the normal is (a, b, c).
            plane = -torch.stack([along_x * fx, along_y * fy, level - x * along_x - y * along_y], 1)
            unit = plane / plane.norm(dim=1, keepdim=True).clamp(min=1e-12)
            found = torch.where(fits[:, None], unit.float(), found)
    return found


def _surface(depth: Tensor, known: Tensor, rounding: float) -> tuple[Tensor, Tensor]:
    """Inverse depth (of a scale of its own) and its slopes along x and y [N, H, W, 3], and where they are known."""
    inverse = torch.where(known, 1 / depth.clamp(min=1e-6), 0.0)
    w = inverse / inverse[known].mean()
    noise = rounding * inverse**2 * w**2
    best = torch.full_like(w, torch.inf)
    chosen = torch.stack([w, torch.zeros_like(w), torch.zeros_like(w)], -1)
    for kind in _KINDS:
        terms, misfit = _fitted(w, known, noise, kind)
        for dy in (0, -kind.reach, kind.reach):
            for dx in (0, -kind.reach, kind.reach):
                surface = _at(torch.roll(terms, (dy, dx), (1, 2)), dx, dy)
                cost = torch.roll(misfit, (dy, dx), (1, 2)) / kind.favour / (_BESIDE if dx or dy else 1.0)
                better = (cost < best) & ((surface[..., 0] - w).abs() < _ACROSS)
                best = torch.where(better, cost, best)
                chosen = torch.where(better[..., None], surface, chosen)
    return chosen, known & torch.isfinite(best)


def _fitted(w: Tensor, known: Tensor, noise: Tensor, kind: _Kind) -> tuple[Tensor, Tensor]:
    """Terms [N, H, W, 6] of the patch about each pixel, and its mean squared misfit; infinite with too few pixels.

    By least squares among the `known`; a misfit is no smaller than the `noise` (variance) of `w`.
    """
    mask, powers = known.double(), _POWERS[: kind.terms]
    moments, weighed = _moments(mask, 2 * kind.order, kind.reach), _moments(w, kind.order, kind.reach)
    matrix = torch.stack([torch.stack([moments[p + r, q + s] for r, s in powers], -1) for p, q in powers], -2)
    vector = torch.stack([weighed[p, q] for p, q in powers], -1)
    squares, count = _moments(w * w, 0, kind.reach)[0, 0], moments[0, 0]
    at = known & (count >= kind.terms + _SPARE)
    own = vector[at]
    solved = torch.linalg.solve(matrix[at] + 1e-9 * torch.eye(kind.terms, dtype=own.dtype), own)
    terms, misfit = w.new_zeros((*w.shape, len(_POWERS))), torch.full_like(w, torch.inf)
    terms[at] = F.pad(solved, (0, len(_POWERS) - kind.terms))
    misfit[at] = ((squares[at] - (solved * own).sum(-1)) / (count[at] - kind.terms)).clamp(min=0) + noise[at]
    return terms, misfit


def _at(terms: Tensor, dx: int, dy: int) -> Tensor:
    """Value and slopes along x and y [N, H, W, 3] of patches at (dx, dy) from their middle."""
    level = (terms * terms.new_tensor([dx**p * dy**q for p, q in _POWERS])).sum(-1)
    along_x = terms[..., 1] + 2 * dx * terms[..., 3] + dy * terms[..., 4]
    along_y = terms[..., 2] + dx * terms[..., 4] + 2 * dy * terms[..., 5]
    return torch.stack([level, along_x, along_y], -1)


def _moments(values: Tensor, order: int, reach: int) -> dict[tuple[int, int], Tensor]:
    """Sums [N, H, W] of values · x^p · y^q over the window around each pixel, p + q up to an order.

    Along rows, then along columns: a window of 13 px is 26 terms of a sum, not 169.
    """
    at = torch.arange(-reach, reach + 1, dtype=values.dtype)
    powers = torch.stack([at**p for p in range(order + 1)])[:, None]
    along = F.conv2d(values[:, None], powers[:, :, None], padding=(0, reach))
    found: dict[tuple[int, int], Tensor] = {}
    for p in range(order + 1):
        own = F.conv2d(along[:, p : p + 1], powers[: order + 1 - p, :, :, None], padding=(reach, 0))
        found |= {(p, q): own[:, q] for q in range(order + 1 - p)}
    return found


def _step(depth: Tensor) -> float:
    """The step (m) that depth was rounded to; 0 where it was not."""
    steps = depth.double().unique().diff()
    steps = steps[steps > 1e-6]  # float32 tells less from another
    return float(steps.min()) if len(steps) else 0.0
