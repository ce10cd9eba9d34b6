"""A patch discriminator (Isola et al. 2017, pix2pix, arXiv:1611.07004)."""

import torch
from torch import Tensor, nn
from torch.nn.utils.parametrizations import spectral_norm

from vision_s2r.translate.config import DiscriminatorConfig


class PatchDiscriminator(nn.Module):
    """Spectrally normalized convolutions (Miyato et al. 2018, arXiv:1802.05957); no statistics over the batch."""

    def __init__(self, cfg: DiscriminatorConfig, pictures: int = 2):
        """`pictures`: how many it sees at once; a translation beside its source, or one alone."""
        super().__init__()
        layers: list[nn.Module] = []
        channels = 3 * pictures
        for layer in range(cfg.layers):
            width = cfg.width * 2**layer
            layers += [spectral_norm(nn.Conv2d(channels, width, 4, stride=2, padding=1)), nn.LeakyReLU(0.2)]
            channels = width
        self.layers = nn.Sequential(*layers, spectral_norm(nn.Conv2d(channels, 1, 3, padding=1)))

    def forward(self, *pictures: Tensor) -> Tensor:
        """Pictures, each [B, 3, H, W] in [0, 1], to a score for each patch [B, 1, H/2^layers, W/2^layers]."""
        score: Tensor = self.layers(2 * torch.cat(pictures, 1) - 1)
        return score
