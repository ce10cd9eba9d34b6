"""How far translations are from the true canonical pictures.

Each metric is float [B, 2]: numerator and denominator, so that its value over any set of pictures is the ratio of their
sums.
"""

from collections.abc import Mapping

import torch
from kornia.metrics import ssim
from torch import Tensor
from torch.nn import functional as F

from vision_s2r.scene import palette
from vision_s2r.translate.losses import OBJECT, SSIM_WINDOW


def picture_metrics(canonical: Tensor, target: Tensor, mask: Tensor) -> dict[str, Tensor]:
    """Of pictures [B, 3, H, W] in [0, 1] against true ones: l1, psnr (dB), ssim (Wang et al. 2004), object_l1.

    `mask`: bool [B, H, W], the pixels of objects, of which object_l1 is the error alone.
    """
    error = (canonical - target).abs().mean(1)
    squared = (canonical - target).square().mean((1, 2, 3))
    return {
        "l1": ratio(error.mean((1, 2))),
        "psnr": ratio(-10 * squared.clamp(min=1e-10).log10()),
        "ssim": ratio(ssim(canonical, target, SSIM_WINDOW).mean((1, 2, 3))),
        "object_l1": ratio((error * mask).sum((1, 2)), mask.sum((1, 2))),
    }


def objects(output: Mapping[str, Tensor], canonical: Tensor) -> Tensor:
    """Where a network sees objects, bool [B, H, W]: by its classes, or without them by the hue of its picture."""
    if "segmentation" in output:
        return output["segmentation"].argmax(1) == OBJECT
    hues = F.normalize(torch.tensor(palette(), device=canonical.device), dim=1)
    return torch.einsum("bchw,kc->bkhw", canonical, hues).argmax(1) == OBJECT


def overlap(guess: Tensor, mask: Tensor) -> Tensor:
    """Intersection over union of masks, bool [B, H, W]."""
    return ratio((guess & mask).sum((1, 2)), (guess | mask).sum((1, 2)))


def ratio(numerator: Tensor, denominator: Tensor | None = None) -> Tensor:
    """[B], [B] to [B, 2]; the denominator of a plain mean is 1."""
    whole = torch.ones_like(numerator) if denominator is None else denominator
    return torch.stack([numerator.float(), whole.float()], 1)
