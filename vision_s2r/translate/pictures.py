"""Grids of pictures to look at: input, output, target, mask, depth."""

import torch
from torch import Tensor

# A colour a class, in the order of `vision_s2r.scene.CLASSES`: background, bin, arm, gripper, object.
PALETTE = torch.tensor(
    [[0.15, 0.15, 0.18], [0.45, 0.45, 0.50], [0.20, 0.45, 0.75], [0.95, 0.60, 0.15], [0.80, 0.20, 0.30]]
)
GAP = 2  # white pixels between the pictures of a grid


def coloured(classes: Tensor) -> Tensor:
    """Class ids int64 [B, H, W] as a picture [B, 3, H, W]."""
    return PALETTE.to(classes.device)[classes].movedim(-1, 1)


def grey(values: Tensor) -> Tensor:
    """Depth [B, 1, H, W] in parts of its range as a picture [B, 3, H, W], near bright."""
    return (1 - values).clamp(0, 1).expand(-1, 3, -1, -1)


def grid(columns: list[Tensor]) -> Tensor:
    """Columns of B pictures [B, 3, H, W] to one picture [3, B·(H+gap)+gap, columns·(W+gap)+gap]."""
    batch, _, height, width = columns[0].shape
    rows, across = batch * (height + GAP) + GAP, len(columns) * (width + GAP) + GAP
    canvas = torch.ones(3, rows, across)
    for c, column in enumerate(columns):
        for r, picture in enumerate(column.clamp(0, 1).cpu()):
            top, left = r * (height + GAP) + GAP, c * (width + GAP) + GAP
            canvas[:, top : top + height, left : left + width] = picture
    return canvas
