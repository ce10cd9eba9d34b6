"""An area that shows what the simulator did not draw: where most frames, and the same place of them, are far off.

A wrong color or grain of a label ends where the label ends; an edge that moved is a line. What is left is one piece
that fills its rectangle, in the same place of most frames.
"""

from collections.abc import Mapping

import cv2
import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.appearance.effects.missing_object import rectangle

_FAR = 16.0  # squared residual, in units of its variance, that is none of the rendered scene's
_OFTEN = 0.5  # share of the frames in which it is
_GAPS, _LINES = 7, 3  # px: gaps that are closed, where it looks like what is behind; lines that are none
_LEAST = 40  # px, of an area
_MOST = 0.5  # share of the picture: what is wrong in more of it is no thing that stands there
_FILLED = 0.5  # of its rectangle
_ALONE = 0.6  # of all that is far off, that is in the rectangle
_BORDER = 2  # px around it, that show both
_DETAIL, _BEHIND = 1 / 255, 0.5  # of what was drawn there: enough to tell; the share of it that no thing lets through
_ALIKE = 0.3  # correlation of the two: less is chance, where a thing has much detail of its own
_OWN = 0.6  # overlap with the place of a label, whose own look it then is

Area = dict[str, float]  # x, y, width, height


def area_of(squared: Tensor, counted: Tensor, shares: Tensor) -> Area | None:
    """The rectangle (px) that shows something else; None where there is none.

    `squared` [B, H, W]: squared residuals in units of their variance; `counted` [B, 1, H, W]: the pixels that count;
    `shares` [B, L, H, W]: the part of each pixel that is of a label.
    """
    far = far_off(squared) & counted[:, 0]
    often = (far.float().mean(0) >= _OFTEN).numpy().astype(np.uint8)
    pieces = cv2.morphologyEx(often, cv2.MORPH_OPEN, np.ones((_LINES, _LINES), np.uint8))
    pieces = cv2.morphologyEx(pieces, cv2.MORPH_CLOSE, np.ones((_GAPS, _GAPS), np.uint8))
    count, which, stats, _ = cv2.connectedComponentsWithStats(pieces)
    if count < 2:
        return None
    largest = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    x, y, width, height, size = (float(each) for each in stats[largest])
    found = {"x": x, "y": y, "width": width, "height": height}
    inside = inside_of(found, squared.shape[-2:])
    alone = float((far & inside).sum()) > _ALONE * float(far.sum())
    fills = size >= max(_LEAST, _FILLED * width * height) and width * height <= _MOST * often.size
    piece = torch.from_numpy(which == largest)
    return found if fills and alone and not _of_a_label(piece, shares) else None


def far_off(squared: Tensor) -> Tensor:
    """Which squared residuals, in units of their variance, are of something that the simulator did not draw."""
    return squared > _FAR


def inside_of(area: Mapping[str, float], shape: tuple[int, ...], scale: float = 1.0) -> Tensor:
    """Where [H, W] (bool) a picture of this shape and `scale` shows the area, or is beside it; none without a size."""
    inside = torch.zeros(tuple(shape), dtype=torch.bool)
    rows, columns = rectangle(area, scale)
    if rows.stop > rows.start and columns.stop > columns.start:
        around = (slice(max(each.start - _BORDER, 0), each.stop + _BORDER) for each in (rows, columns))
        inside[tuple(around)] = True
    return inside


def seen_behind(real: Tensor, drawn: Tensor, inside: Tensor) -> bool:
    """Whether `real` [B, C, H, W] has, `inside` [B, 1, H, W], most of the detail that was drawn: no thing hides it."""
    real, drawn = (each - F.avg_pool2d(each, 5, 1, 2) for each in (real, drawn))
    size, own, common = (float((each * inside).sum()) for each in (drawn.square(), real.square(), real * drawn))
    clear = size > _DETAIL**2 * float(inside.sum()) * real.shape[1]
    return clear and common > _BEHIND * size and common > _ALIKE * (size * own) ** 0.5


def _of_a_label(piece: Tensor, shares: Tensor) -> bool:
    """Whether the piece [H, W] (bool) is where most frames have one label."""
    own = (shares > 0.5).float().mean(0) >= _OFTEN
    both = (own & piece).sum((1, 2)).float() / (own | piece).sum((1, 2)).clamp(min=1)
    return bool((both > _OWN).any())
