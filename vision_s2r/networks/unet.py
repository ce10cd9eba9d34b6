"""The U-Net: from a picture to maps of it, such as its canonical look, segmentation and depth.

All of the work is done from half resolution down, reached by moving pixels into channels (the reverse of Shi et al.
2016, arXiv:1609.05158), which loses nothing: thin layers at full resolution cost a CPU most of its time and little is
gained by them. Where the canonical picture is composed, its edges are those of the classes, sharp by construction.
"""

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from vision_s2r.errors import UserError
from vision_s2r.networks.rectifier import Rectifier
from vision_s2r.options import option, validate
from vision_s2r.scene import palette

GROUP = 8  # channels a group of a normalization
WIDEST = 4  # times the channels of the finest level; no level has more
CORRECTION = 0.25  # of a map where it corrects a picture: Adam's first steps are large for one that begins at zero
MOST_CHANNELS = 64  # of a map
LIT = 0.8  # shading where nothing is known yet: that of a typical pixel


@dataclass
class NetworkConfig:
    """The size of a U-Net; 1.8 M parameters as it stands. The side of a picture is a multiple of 2^levels."""

    width: int = option(
        32,
        "Channels at half the picture's resolution, the finest that most of it works at; each coarser level has twice, "
        "at most 4 times as many.",
        above=0,
        high=512,
        multiple=GROUP,
    )
    levels: int = option(4, "Resolutions, from a half down to 1 / 2^levels.", low=1, high=8)
    blocks: int = option(1, "Residual blocks of a level on the way down, and again on the way up.", low=1, high=32)
    detail: int = option(
        0,
        "Channels of a stage at full resolution, which free pixels want and composed pictures do not; 0: none.",
        low=0,
        high=512,
        multiple=GROUP,
    )
    rectifier: int = option(
        16,
        "Channels of what undoes the camera's pose and lens before all else; 0: nothing does.",
        low=0,
        high=512,
        multiple=GROUP,
    )
    looks: int = option(2, "How often the rectifier looks, each time at what it has rectified so far.", low=1, high=8)
    composed: bool = option(
        False,
        "Whether the canonical picture is composed: the classes' colours, mixed by their chances, times a shading that "
        "the network predicts. Else, and where it gives no classes, its three channels are free.",
    )
    residual: bool = option(
        False, "Whether pictures (maps of 3 channels) are corrections of the picture that comes in, at first none."
    )


class Convolution(nn.Module):
    """A 3 x 3 convolution whose kernel is a matrix [outputs, 9 · inputs], laid out as channels_last wants it.

    Matrices are what Muon (Jordan et al. 2024) takes.
    """

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        self.shape = (outputs, 3, 3, inputs)
        self.kernel = nn.Parameter(torch.empty(outputs, 9 * inputs))
        nn.init.kaiming_uniform_(self.kernel, nonlinearity="relu")
        self.bias = nn.Parameter(torch.zeros(outputs))

    def forward(self, x: Tensor) -> Tensor:
        return F.conv2d(x, self.kernel.view(self.shape).permute(0, 3, 1, 2), self.bias, padding=1)


class ResidualBlock(nn.Module):
    """Two convolutions beside an identity (He et al. 2016, arXiv:1603.05027); normalized once, by groups."""

    def __init__(self, channels: int):
        super().__init__()
        self.norm = nn.GroupNorm(channels // GROUP, channels)
        self.first = Convolution(channels, channels)
        self.second = Convolution(channels, channels)
        nn.init.zeros_(self.second.kernel)  # each block begins as the identity

    def forward(self, x: Tensor) -> Tensor:
        return x + self.second(F.relu(self.first(F.relu(self.norm(x)))))


class Stage(nn.Sequential):
    """Residual blocks at one resolution."""

    def __init__(self, channels: int, blocks: int):
        super().__init__(*(ResidualBlock(channels) for _ in range(blocks)))


class _Detail(nn.Module):
    """A thin stage at full resolution, which sees the source pixels again."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        self.unfold = nn.Conv2d(inputs, 4 * outputs, 1)
        self.mix = nn.Conv2d(outputs + 3, outputs, 3, padding=1)

    def forward(self, x: Tensor, source: Tensor) -> Tensor:
        return self.mix(torch.cat([F.pixel_shuffle(self.unfold(x), 2), source], 1))


class UNet(nn.Module):
    """U-Net (Ronneberger et al. 2015, arXiv:1505.04597), its skips added rather than concatenated.

    In: float [B, 3, H, W] in [0, 1], H and W multiples of 2^levels. Out: a map [B, heads[name], H, W] for each
    of `heads` (name: channels), linear; and where there is a rectifier `displacements` [B, looks, 2, points, points],
    after each look. A composed `canonical` is the classes' colours, mixed by the softmax of `segmentation`, times a
    shading that the network gives in its place.
    """

    def __init__(self, cfg: NetworkConfig, heads: dict[str, int]):
        super().__init__()
        validate(cfg, "network")
        if not heads or not all(isinstance(each, int) and 1 <= each <= MOST_CHANNELS for each in heads.values()):
            raise UserError(f"heads are {heads!r:.80}: expected channels, 1 to {MOST_CHANNELS}, of each map")
        self.composed = cfg.composed and {"canonical", "segmentation"} <= heads.keys()
        maps = heads | ({"canonical": 1} if self.composed else {})
        self.heads = dict(sorted(maps.items()))  # channels must not depend on how a dictionary was ordered
        self.rectifier = Rectifier(cfg.rectifier, cfg.looks) if cfg.rectifier else None
        widths = [cfg.width * min(2**level, WIDEST) for level in range(cfg.levels)]
        pairs = list(pairwise(widths))
        self.stem = nn.Conv2d(3 * 4, widths[0], 3, padding=1)
        self.down = nn.ModuleList(Stage(w, cfg.blocks) for w in widths[:-1])
        self.downsample = nn.ModuleList(nn.Conv2d(w, v, 2, stride=2) for w, v in pairs)
        self.bottom = Stage(widths[-1], 2 * cfg.blocks)
        self.upsample = nn.ModuleList(nn.Conv2d(v, w, 1) for w, v in pairs)
        self.up = nn.ModuleList(Stage(w, cfg.blocks) for w in widths[:-1])
        self.detail = _Detail(widths[0], cfg.detail) if cfg.detail else None
        last, cells = (cfg.detail, 1) if cfg.detail else (widths[0], 4)
        self.norm = nn.GroupNorm(last // GROUP, last)
        self.head = nn.Conv2d(last, cells * sum(maps.values()), 3, padding=1)
        self.residual = cfg.residual
        if cfg.residual:
            for parameter in self.head.parameters():
                nn.init.zeros_(parameter)
        self.register_buffer("palette", torch.tensor(palette()), persistent=False)

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
            x = stage(skips.pop() + F.interpolate(upsample(x), scale_factor=2.0, mode="nearest"))
        if self.detail is not None:
            x = self.detail(x, source)
        x = self.head(F.relu(self.norm(x))).float()
        x = x if self.detail is not None else F.pixel_shuffle(x, 2)
        maps = dict(zip(self.heads, x.split(list(self.heads.values()), 1), strict=True))
        if self.composed:
            maps["canonical"] = self._composed(maps["segmentation"], maps["canonical"])
        if self.residual:
            maps = {name: images + CORRECTION * each if self.heads[name] == 3 else each for name, each in maps.items()}
        return maps | extra

    def _composed(self, logits: Tensor, shading: Tensor) -> Tensor:
        """The canonical picture [B, 3, H, W] of the classes' logits [B, C, H, W] and a shading [B, 1, H, W]."""
        with torch.autocast(logits.device.type, enabled=False):
            colours = torch.einsum("bchw,cd->bdhw", logits.softmax(1), self.palette)
        return (LIT + shading) * colours
