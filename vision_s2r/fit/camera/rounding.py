"""Colours that a renderer rounded: what lies flat is off by the same part of a step in all of its pixels.

Thousands of pixels would tell of a gain that is no more than this. Where labels say that pictures are rendered, each
colour's own part of a step is a nuisance, fitted to each frame alike under every hypothesis.
"""

import torch
from torch import Tensor

from vision_s2r.fit.camera.prediction import Pictures

_STEP = 1 / 255  # of 8 bits
_MANY = 48  # pixels of a frame, that have a colour of their own


def rendered_colours(pictures: Pictures) -> list[Tensor]:
    """Of each frame, which of its rendered colours each pixel [H, W] has, from 1; 0 where few have it.

    Nothing where the simulator's values are finer than 8 bits, or no label says that it rendered them.
    """
    whole = (pictures.sim * 255 - (pictures.sim * 255).round()).abs().max() < 1e-3
    if pictures.surfaces is None or pictures.scale < 1 or not whole:
        return []
    found = []
    for picture in (pictures.sim * 255).round().long():
        code = picture[0]
        for channel in picture[1:]:
            code = code * 256 + channel
        _, index, counts = code.unique(return_inverse=True, return_counts=True)
        numbers = torch.where(counts >= _MANY, (counts >= _MANY).cumsum(0), 0)
        found.append(numbers[index])
    return found


def unrounded(residual: Tensor, colours: Tensor, counted: Tensor) -> Tensor:
    """Residuals [1, C, H, W] without the mean of those of one colour, of which half a step may be its rounding."""
    number = (colours * counted[0, 0]).flatten()
    size = int(colours.max()) + 1
    count = torch.bincount(number, minlength=size).clamp(min=1)
    left = []
    for channel in residual[0]:
        mean = torch.bincount(number, channel.flatten(), size) / count
        mean[0] = 0.0
        left.append(channel - mean.clamp(-_STEP / 2, _STEP / 2).float()[colours])
    return torch.stack(left)[None]
