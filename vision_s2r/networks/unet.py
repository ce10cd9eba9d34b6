"""The U-Net: from a picture to maps of it, such as its canonical look, segmentation and depth.

Most of the work is done from half resolution down, reached by moving pixels into channels (the reverse of Shi et al.
2016, arXiv:1609.05158), which loses nothing and is four times cheaper. A thin full-resolution stage at the end, which
sees the source pixels again, puts edges where they belong.
"""

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from vision_s2r.options import option, validate

GROUP = 8  # channels a group of a normalization
POINTS = 5  # of the rectifier's grid, along each side


@dataclass
class NetworkConfig:
    """The size of a U-Net; 1.2 M parameters as it stands. The side of a picture is a multiple of 2^levels."""

    width: int = option(
        16,
        "Channels at half the picture's resolution, the finest that most of it works at; each coarser level has twice.",
        above=0,
        multiple=GROUP,
    )
    levels: int = option(4, "Resolutions, from a half down to 1 / 2^levels.", low=1)
    blocks: int = option(1, "Residual blocks of a level on the way down, and again on the way up.", low=1)
    detail: int = option(16, "Channels of the last layers, at full resolution.", above=0, multiple=GROUP)
    rectifier: int = option(
        16,
        "Channels of what undoes the camera's pose and lens before all else; 0: nothing does.",
        low=0,
        multiple=GROUP,
    )
    residual: bool = option(
        False, "Whether pictures (maps of 3 channels) are corrections of the picture that comes in, at first none."
    )


class ResidualBlock(nn.Module):
    """Pre-activation residual block (He et al. 2016, arXiv:1603.05027) with group instead of batch statistics."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        self.norm1 = nn.GroupNorm(inputs // GROUP, inputs)
        self.conv1 = nn.Conv2d(inputs, outputs, 3, padding=1, bias=False)
        self.norm2 = nn.GroupNorm(outputs // GROUP, outputs)
        self.conv2 = nn.Conv2d(outputs, outputs, 3, padding=1)
        self.skip = nn.Conv2d(inputs, outputs, 1) if inputs != outputs else nn.Identity()
        nn.init.zeros_(self.conv2.weight)  # each block begins as its skip

    def forward(self, x: Tensor) -> Tensor:
        y = self.conv1(F.silu(self.norm1(x)))
        y = self.conv2(F.silu(self.norm2(y)))
        return self.skip(x) + y


class Stage(nn.Sequential):
    """Residual blocks at one resolution."""

    def __init__(self, inputs: int, outputs: int, blocks: int):
        super().__init__(*(ResidualBlock(inputs if i == 0 else outputs, outputs) for i in range(blocks)))


class Rectifier(nn.Module):
    """Sees how the camera that took a picture hangs, and undoes it: a spatial transformer (Jaderberg et al. 2015).

    In: float [B, 3, H, W]. Out: the picture sampled at a smooth field of displacements, and the field's values
    [B, 2, points, points] (right, down; in halves of the picture's side) on a grid from corner to corner. It begins
    as the identity.
    """

    def __init__(self, width: int, points: int = POINTS):
        super().__init__()
        self.points = points
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
        self.displacements = nn.Linear(8 * width, 2 * points**2)
        nn.init.zeros_(self.displacements.weight)
        nn.init.zeros_(self.displacements.bias)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        features = self.features(4 * (images - 0.5))
        coarse = self.displacements(features).float().view(-1, 2, self.points, self.points)
        return displaced(images, coarse), coarse


def displaced(images: Tensor, displacements: Tensor) -> Tensor:
    """Pictures [B, C, H, W] sampled at displacements [B, 2, points, points], as a Rectifier gives them."""
    height, width = images.shape[-2:]
    field = F.interpolate(displacements, size=(height, width), mode="bilinear", align_corners=True)
    still = F.affine_grid(torch.eye(2, 3, device=images.device)[None], [1, 1, height, width], align_corners=False)
    places = still + field.movedim(1, -1)
    return F.grid_sample(images.float(), places, padding_mode="border", align_corners=False)


def _halving(inputs: int, outputs: int) -> list[nn.Module]:
    return [
        nn.Conv2d(inputs, outputs, 3, stride=2, padding=1, bias=False),
        nn.GroupNorm(outputs // GROUP, outputs),
        nn.SiLU(),
    ]


class UNet(nn.Module):
    """U-Net (Ronneberger et al. 2015, arXiv:1505.04597).

    In: float [B, 3, H, W] in [0, 1], H and W multiples of `stride`. Out: a map [B, heads[name], H, W] for each
    of `heads` (name: channels), linear; and where there is a rectifier its `displacements`.
    """

    def __init__(self, cfg: NetworkConfig, heads: dict[str, int]):
        super().__init__()
        self.heads = dict(sorted(heads.items()))  # channels must not depend on how a dictionary was ordered
        self.stride = 2**cfg.levels
        widths = [cfg.width * 2**level for level in range(cfg.levels)]
        validate(cfg, "network")
        self.rectifier = Rectifier(cfg.rectifier) if cfg.rectifier else None
        self.stem = nn.Conv2d(3 * 4, widths[0], 3, padding=1)
        pairs = list(pairwise(widths))
        self.down = nn.ModuleList(Stage(w, w, cfg.blocks) for w in widths[:-1])
        self.downsample = nn.ModuleList(nn.Conv2d(w, v, 2, stride=2) for w, v in pairs)
        self.bottom = Stage(widths[-1], widths[-1], 2 * cfg.blocks)
        self.upsample = nn.ModuleList(nn.Conv2d(v, w, 1) for w, v in pairs)
        self.up = nn.ModuleList(Stage(2 * w, w, cfg.blocks) for w in widths[:-1])
        self.unfold = nn.Conv2d(widths[0], 4 * cfg.detail, 1)
        self.detail = nn.Conv2d(cfg.detail + 3, cfg.detail, 3, padding=1)
        self.norm = nn.GroupNorm(cfg.detail // GROUP, cfg.detail)
        self.head = nn.Conv2d(cfg.detail, sum(heads.values()), 3, padding=1)
        self.residual = cfg.residual
        if cfg.residual:
            for parameter in self.head.parameters():
                nn.init.zeros_(parameter)

    def forward(self, images: Tensor) -> dict[str, Tensor]:
        extra = {}
        if self.rectifier is not None:
            images, extra["displacements"] = self.rectifier(images)
        source = 4 * (images - 0.5)
        x = self.stem(F.pixel_unshuffle(source, 2))
        skips = []
        for stage, downsample in zip(self.down, self.downsample, strict=True):
            x = stage(x)
            skips.append(x)
            x = downsample(x)
        x = self.bottom(x)
        for stage, upsample in zip(reversed(self.up), reversed(self.upsample), strict=True):
            x = F.interpolate(upsample(x), scale_factor=2.0, mode="bilinear", align_corners=False)
            x = stage(torch.cat([x, skips.pop()], 1))
        x = F.pixel_shuffle(self.unfold(x), 2)
        x = self.detail(torch.cat([x, source], 1))
        x = self.head(F.silu(self.norm(x)))
        maps = dict(zip(self.heads, x.split(list(self.heads.values()), 1), strict=True))
        if self.residual:
            maps = {name: each + images if self.heads[name] == 3 else each for name, each in maps.items()}
        return maps | extra
