"""What undoes the pose and the lens of the camera that took a picture: a spatial transformer."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

GROUP = 8  # channels a group of a normalization
POINTS = 5  # of the rectifier's grid, along each side


class Rectifier(nn.Module):
    """Sees how the camera that took a picture hangs, and undoes it (Jaderberg et al. 2015, arXiv:1506.02025).

    It looks more than once (Lin and Lucey 2017, arXiv:1612.03897): first at the picture, then at what it has made of
    it, which leaves less to see; each look has weights of its own. In: float [B, 3, H, W]. Out: the picture sampled at
    a smooth field of displacements, and the field's values after each look, [B, looks, 2, points, points] (right, down;
    in halves of the picture's side), on a grid from corner to corner. It begins as the identity.
    """

    def __init__(self, width: int, looks: int = 2):
        """`width`: channels of the first layer of a look."""
        super().__init__()
        self.looks = nn.ModuleList(_Look(width) for _ in range(looks))

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        found: list[Tensor] = []
        seen = images
        for look in self.looks:
            found.append(look(seen) + (found[-1].detach() if found else 0))
            seen = displaced(images, found[-1])
        return seen, torch.stack(found, 1)


class _Look(nn.Module):
    """Displacements [B, 2, points, points] that a picture still wants."""

    def __init__(self, width: int):
        super().__init__()
        self.features = nn.Sequential(
            nn.PixelUnshuffle(2),
            *_halving(12, width),
            *_halving(width, 2 * width),
            *_halving(2 * width, 4 * width),
            nn.AdaptiveAvgPool2d(4),
            nn.Flatten(),
            nn.Linear(64 * width, 8 * width),
            nn.SiLU(),
        )
        self.displacements = nn.Linear(8 * width, 2 * POINTS**2)
        nn.init.zeros_(self.displacements.weight)
        nn.init.zeros_(self.displacements.bias)

    def forward(self, images: Tensor) -> Tensor:
        return self.displacements(self.features(4 * (images - 0.5))).float().view(-1, 2, POINTS, POINTS)


def _halving(inputs: int, outputs: int) -> list[nn.Module]:
    return [
        nn.Conv2d(inputs, outputs, 3, stride=2, padding=1, bias=False),
        nn.GroupNorm(outputs // GROUP, outputs),
        nn.SiLU(),
    ]


def displaced(images: Tensor, displacements: Tensor) -> Tensor:
    """Pictures [B, C, H, W] sampled at displacements [B, 2, points, points], as a look gives them."""
    height, width = images.shape[-2:]
    field = F.interpolate(displacements, size=(height, width), mode="bilinear", align_corners=True)
    still = F.affine_grid(torch.eye(2, 3, device=images.device)[None], [1, 1, height, width], align_corners=False)
    places = still + field.movedim(1, -1)
    return F.grid_sample(images.float(), places, padding_mode="border", align_corners=False)
