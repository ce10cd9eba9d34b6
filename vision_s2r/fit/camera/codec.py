"""What JPEG makes of noise, which depends on what it is noise on."""

import math

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.fit.camera.prediction import Pictures, encoded
from vision_s2r.fit.case import Values

_BLOCK = 8  # px, of the codec
_DRAWS = 4  # of noise


def attenuation(quality: float, channels: int) -> tuple[Tensor, Tensor]:
    """What JPEG leaves of white noise: its standard deviation before and after [levels], in [0, 1] segments.

    Measured by the encoder on a soft gradient, at coded mid grey.
    """
    generator = torch.Generator().manual_seed(0)
    before = torch.tensor([0.0, 0.25, 0.5, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64]) / 255
    ramp = torch.linspace(0.35, 0.65, 64)
    clean = ((ramp[:, None] + ramp) / 2).expand(1, channels, 64, 64)
    noise = torch.randn((len(before), channels, 64, 64), generator=generator) * before[:, None, None, None]
    after = (encoded((clean + noise).clamp(0, 1), quality) - encoded(clean, quality)).square().mean((1, 2, 3)).sqrt()
    return before, torch.cummax(after, 0).values


def codec_scatter(pictures: Pictures, reference: Values, quality: float, residual: Tensor, counted: Tensor) -> Tensor:
    """The variance [N, 1, H, W] that JPEG makes of little noise, beyond what it leaves of it where the picture is flat.

    A coefficient near the middle between two levels falls on either side; busy blocks have more of these. The noise is
    as strong as makes the codec's scatter as large as the quieter half of the residuals.
    """
    bare = {name: value for name, value in reference.items() if name != "jpeg_compression"}
    clean = pictures.predict(bare, range(len(pictures.sim))).mean
    through = encoded(clean, quality)
    generator = torch.Generator().manual_seed(0)
    draws = [torch.randn(clean.shape, generator=generator) for _ in range(_DRAWS)]
    inside = _block_means(counted.float()) == 1
    seen = _block_means(residual.square().mean(1, keepdim=True))[inside].median()
    best, found = math.inf, torch.zeros_like(counted, dtype=torch.float32)
    before, after = attenuation(quality, clean.shape[1])
    for level, flat in zip(before[1:7].tolist(), after[1:7].tolist(), strict=True):
        squares = [(encoded((clean + level * draw).clamp(0, 1), quality) - through).square() for draw in draws]
        scatter = _block_means(torch.stack(squares).mean(0).mean(1, keepdim=True))
        distance = abs(math.log(float(scatter[inside].median()) / max(float(seen), 1e-12) + 1e-9))
        if distance < best:
            best = distance
            found = (_enlarged(scatter, clean) - flat**2).clamp(min=0)
    return found


def within_blocks(values: Tensor) -> Tensor:
    """Values [N, C, H, W] less the mean of their block, where a codec puts what is smooth."""
    return values - _enlarged(_block_means(values), values)


def _block_means(values: Tensor) -> Tensor:
    """Of values [N, C, H, W], [N, C, H / 8, W / 8] rounded up; a block at the rim is of the pixels that there are."""
    return F.avg_pool2d(values, _BLOCK, ceil_mode=True)


def _enlarged(blocks: Tensor, like: Tensor) -> Tensor:
    """What each block has, at each of its pixels: as high and wide as `like`."""
    height, width = like.shape[-2:]
    return blocks.repeat_interleave(_BLOCK, -2).repeat_interleave(_BLOCK, -1)[..., :height, :width]
