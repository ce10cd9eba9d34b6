"""The translator of the literature, to compare with: the U-Net of pix2pix (Isola et al. 2017, arXiv:1611.07004)."""

from itertools import pairwise
from typing import Any

import torch
from torch import Tensor, nn

from vision_s2r.camera import CameraConfig
from vision_s2r.training import ViewSource, adamw
from vision_s2r.translate.config import TranslateConfig
from vision_s2r.translate.rcan import Rcan

LEVELS = 8  # of the published network, at 256 px
WIDEST = 8  # times the channels of the first level; no level has more


class Pix2PixUNet(nn.Module):
    """C64-C128-C256-C512-C512-…: 4 x 4 convolutions of stride 2 down to the bottom, transposed ones back up.

    In: float [B, 3, H, W] in [0, 1], H and W multiples of 2^levels. Out: `canonical` [B, 3, H, W] in [0, 1].

    As published: no normalization in the first level, at the bottom and at the end, leaky ReLU (0.2) down and ReLU up,
    tanh at the end, weights from N(0, 0.02). The published batch normalization takes the batch's statistics in test
    too; at the published batch of one that is instance normalization, which it is here at any batch. (With running
    averages in test the error fell later.) There is no dropout: it is the noise of a GAN, which is not trained here.
    """

    def __init__(self, levels: int, width: int = 64):
        """`width`: channels of the first level."""
        super().__init__()
        widths = [3, *(width * min(2**level, WIDEST) for level in range(levels))]
        self.down, self.up = nn.ModuleList(), nn.ModuleList()
        for level, (outer, inner) in enumerate(pairwise(widths)):
            top, bottom = level == 0, level == levels - 1
            down = nn.Conv2d(outer, inner, 4, stride=2, padding=1, bias=False)
            up = nn.ConvTranspose2d(inner if bottom else 2 * inner, outer, 4, stride=2, padding=1, bias=top)
            activation = nn.Identity() if top else nn.LeakyReLU(0.2)
            self.down.append(nn.Sequential(activation, down, _norm(inner, not top and not bottom)))
            self.up.insert(0, nn.Sequential(nn.ReLU(), up, _norm(outer, not top)))
            for layer in (down, up):
                nn.init.normal_(layer.weight, 0, 0.02)

    def forward(self, images: Tensor) -> dict[str, Tensor]:
        skips = [2 * images - 1]
        for layer in self.down:
            skips.append(layer(skips[-1]))
        x = skips.pop()
        for layer in self.up[:-1]:
            x = torch.cat([layer(x), skips.pop()], 1)
        return {"canonical": (self.up[-1](x).tanh() + 1) / 2}


class Pix2PixUNetTraining(Rcan):
    """The translator's training with that network in place of its own, and all else the same.

    The losses can be those of the picture alone: the network gives nothing else.
    """

    kind = "pix2pix_unet"

    def __init__(
        self,
        width: int,
        cfg: TranslateConfig,
        camera: CameraConfig,
        validation_camera: CameraConfig,
        views: ViewSource,
    ):
        """`width`: channels of the first level; the rest as `Rcan`."""
        super().__init__(cfg, camera, validation_camera, views)
        unet = Pix2PixUNet(levels(views.size), width)
        unet.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.networks = {"unet": unet}
        self.optimizers: dict[str, torch.optim.Optimizer] = {"unet": adamw(unet, cfg.training)}
        reference: dict[str, Any] = {"levels": levels(views.size), "width": width}
        self.configuration["network"] = reference


def levels(size: int) -> int:
    """Halvings of a picture of `size` px, at most as many as the published network has at 256 px."""
    return min(LEVELS, (size & -size).bit_length() - 1)


def _norm(channels: int, normalized: bool) -> nn.Module:
    return nn.InstanceNorm2d(channels, affine=True) if normalized else nn.Identity()
