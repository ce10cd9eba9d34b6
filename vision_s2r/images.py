"""The two forms of a picture: uint8 channels-last at rest, float channels-first inside networks."""

import torch
from torch.nn import functional as F

from vision_s2r.errors import UserError


def to_float(images: torch.Tensor) -> torch.Tensor:
    """uint8 [..., H, W, 3] to float32 [..., 3, H, W] in [0, 1].

    Raises UserError where the type or the number of channels is another.
    """
    if images.dtype != torch.uint8 or images.ndim < 3 or images.shape[-1] != 3:
        raise UserError(
            f"picture of type {images.dtype} and shape {tuple(images.shape)}: expected uint8 [..., H, W, 3]"
        )
    return images.movedim(-1, -3).float().div_(255)


def to_uint8(images: torch.Tensor) -> torch.Tensor:
    """float [..., 3, H, W] in [0, 1] to uint8 [..., H, W, 3], rounded; values outside are clipped."""
    return images.detach().float().clamp(0, 1).mul(255).round().to(torch.uint8).movedim(-3, -1).contiguous()


def reduced(images: torch.Tensor, size: int) -> torch.Tensor:
    """Pictures of H px a side, in either form, as pictures of `size` px, of which H is a multiple.

    Means of squares of pixels: uint8 [N, H, H, 3] gives uint8, float [N, 3, H, H] float.
    """
    factor = images.shape[2] // size
    if factor == 1:
        return images
    if images.dtype == torch.uint8:
        return to_uint8(reduced(to_float(images), size))
    return F.avg_pool2d(images, factor)
