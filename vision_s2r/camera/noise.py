"""Noise that is a pure function of a seed."""

import torch
from torch import Tensor

from vision_s2r.camera.effect import Frame


def standard_normal(images: Tensor, frame: Frame, stream: int) -> Tensor:
    """Independent N(0, 1) in the shape, type and place of `images` [B, C, H, W].

    A sample's noise is a function of its seed, its shape, `stream` (a number of the effect's own) and the kind of
    device alone: the same in any batch, drawn where the pictures lie, in single precision.
    """
    shape, device = images.shape[1:], images.device
    generator = torch.Generator(device)
    # The generator keeps 32 bits of its seed; the odd factor (golden ratio) keeps the streams of close seeds
    # apart.
    seeds = [(seed + stream * 0x9E3779B1) % 2**32 for seed in frame.seeds.tolist()]
    draws = [torch.randn(shape, generator=generator.manual_seed(seed), device=device) for seed in seeds]
    return torch.stack(draws).to(images)
