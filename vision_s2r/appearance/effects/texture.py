"""A surface has a grain that the render lacks."""

from collections.abc import Mapping

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.appearance.effect import APPEARANCE_EFFECTS, AppearanceEffect, Scene
from vision_s2r.effects import Parameter

_REACH = 2.0  # correlation lengths, beyond which the kernel is nothing


@APPEARANCE_EFFECTS.register
class Texture(AppearanceEffect):
    """Linear light × (1 + amplitude·g) on one label, g a Gaussian field that correlates by exp(−(d/scale)²).

    The grain is a function of the picture's seed: it is as strong and as coarse as the real one, not the same.
    """

    name = "texture"
    order = 40
    labelled = True
    parameters = (
        Parameter("amplitude", "", low=0.0, high=1.0, neutral=0.0, moderate=0.1),
        Parameter("scale", "px", low=0.5, high=64.0, neutral=None, moderate=6.0, scale="log"),
    )

    def apply(self, light: Tensor, values: Mapping[str, float], scene: Scene, region: Tensor) -> Tensor:
        grain = torch.stack([_field(light.shape[-2:], values["scale"], seed) for seed in scene.seeds])
        return light * (1 + values["amplitude"] * region * grain[:, None].to(light)).clamp(min=0)


def _field(shape: torch.Size, scale: float, seed: int) -> Tensor:
    """White noise under a Gaussian of half the correlation length, of unit variance [H, W]."""
    height, width = shape
    reach = max(int(_REACH * scale + 0.5), 1)
    white = torch.randn((height + 2 * reach, width + 2 * reach), generator=torch.Generator().manual_seed(seed % 2**31))
    kernel = torch.exp(-2 * (torch.arange(-reach, reach + 1) / scale).square())
    kernel = kernel / kernel.square().sum().sqrt()
    along = F.conv2d(white[None, None], kernel[None, None, None, :])
    return F.conv2d(along, kernel[None, None, :, None])[0, 0]
