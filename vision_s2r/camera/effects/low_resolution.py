"""The sensor, or the driver, delivers fewer pixels than the picture has."""

from collections.abc import Mapping

import torch
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame
from vision_s2r.effects import Parameter


@CAMERA_EFFECTS.register
class LowResolution(CameraEffect):
    """Down by area to round(size/factor), up again bilinearly, on coded values.

    Differentiable in the picture; in the factor it goes by steps, and has no gradient.
    """

    name = "low_resolution"
    order = 90
    optical = False
    linear_light = False
    parameters = (Parameter("factor", "", low=1.0, high=16.0, neutral=1.0, moderate=2.0, scale="log"),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        factor = values["factor"].detach()
        down_and_up = [_down_and_up(size, factor)[:, None] for size in (frame.height, frame.width)]
        return down_and_up[0] @ images @ down_and_up[1].mT


def _down_and_up(size: int, factor: Tensor) -> Tensor:
    """The map [B, size, size] of one axis: area mean to round(size/factor) cells, bilinear back."""
    cells = (size / factor).round().clamp(min=1)[:, None, None]
    pixel = torch.arange(size, dtype=factor.dtype, device=factor.device)
    cell = pixel[:, None]  # as many as there can be; those beyond `cells` are never read
    per_cell = size / cells
    overlap = torch.minimum((cell + 1) * per_cell, pixel + 1) - torch.maximum(cell * per_cell, pixel)
    down = overlap.clamp(min=0) / per_cell
    position = torch.minimum((((pixel + 0.5) / per_cell) - 0.5).clamp(min=0), cells - 1)
    up = (1 - (position.mT - pixel).abs()).clamp(min=0)
    return up @ down
