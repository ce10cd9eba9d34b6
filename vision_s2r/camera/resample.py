"""Pictures between the pixels: warps, and the kernels of blurs."""

import math

import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera.effect import Frame, Interpolation

_KEYS_A = -0.75  # Keys' cubic as OpenCV and torch define bicubic
_SIDE_BY_SIDE = 12  # pictures that a processor convolves at once: of fewer, strips


def warp(images: Tensor, x: Tensor, y: Tensor, frame: Frame) -> Tensor:
    """Pictures [B, C, h, w] sampled at `x`, `y` [B, h', w'] (pixels, as Frame has them): [B, C, h', w'].

    What lies outside the canvas repeats its edge. Differentiable in everything.
    """
    height, width = images.shape[-2:]
    scale_x, scale_y = 2 / (width - 1), 2 / (height - 1)  # from the canvas' pixels to its [-1, 1]
    grid = torch.stack([x * scale_x + (frame.margin * scale_x - 1), y * scale_y + (frame.margin * scale_y - 1)], dim=-1)
    return F.grid_sample(images, grid, mode=frame.interpolation, padding_mode="border", align_corners=True)


def interpolation_weight(distance: Tensor, interpolation: Interpolation) -> Tensor:
    """Weight of a pixel at this distance (px) along one axis; zero from 2 px (bicubic) or 1 px (bilinear) on.

    Source: Keys 1981, "Cubic convolution interpolation for digital image processing".
    """
    d = distance.abs()
    if interpolation == "bilinear":
        return (1 - d).clamp(min=0)
    inner = ((_KEYS_A + 2) * d - (_KEYS_A + 3)) * d * d + 1
    outer = _KEYS_A * (((d - 5) * d + 8) * d - 4)
    return torch.where(d <= 1, inner, torch.where(d < 2, outer, torch.zeros_like(d)))


def convolve(images: Tensor, kernels: Tensor) -> Tensor:
    """Pictures [B, C, h, w], each under its own of the point-symmetric `kernels` [B, K, K], K odd.

    Kernels are normalized to a sum of 1; the pictures' edges repeat.
    """
    batch, channels, height, width = images.shape
    kernels = kernels / kernels.sum((1, 2), keepdim=True)
    count = max(_SIDE_BY_SIDE // (batch * channels), 1)
    rows, around = math.ceil(height / count), kernels.shape[-1] - 1
    edges = (*(around // 2,) * 3, around // 2 + count * rows - height)
    padded = F.pad(images, edges, mode="replicate").flatten(0, 1)
    strips = padded.unfold(1, rows + around, rows).mT  # [B·C, count, rows + around, w + around]
    weight = kernels[:, None].repeat_interleave(channels * count, dim=0)
    found = F.conv2d(strips.flatten(0, 1)[None], weight, groups=len(weight))
    return found.reshape(batch, channels, count * rows, width)[:, :, :height].contiguous()
