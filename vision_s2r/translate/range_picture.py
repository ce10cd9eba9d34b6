"""How far ranges have widened, beside those that were picked by hand, as a picture."""

import numpy as np
import torch
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.randomize import Dimension, Range
from vision_s2r.translate.adr import CameraAdr

HAND_PICKED, WIDENED = "#9aa5b1", "#2f7ed8"
DPI = 100


def draw(adr: CameraAdr) -> Tensor:
    """A row a dimension, from its lower to its upper limit: float [3, H, W] in [0, 1]."""
    dimensions = adr.ranges.dimensions
    rows = np.arange(len(dimensions))
    figure = Figure(figsize=(7.5, 0.7 + 0.2 * len(dimensions)), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    hand_picked = np.array([_hand_picked(adr, each) for each in dimensions])
    for ends, offset, colour, label in (
        (hand_picked, -0.2, HAND_PICKED, "picked by hand"),
        (adr.ranges.bounds, 0.2, WIDENED, "widened"),
    ):
        axes.barh(rows + offset, np.diff(ends)[:, 0], 0.4, left=ends[:, 0], color=colour, label=label)
    labels = [f"{each.name.replace('_', ' ').replace('.', ', ')}: {each.low:g} to {each.high:g}" for each in dimensions]
    axes.set_yticks(rows, labels, fontsize=8)
    axes.set_xlim(0, 1)
    axes.set_ylim(-0.7, len(dimensions) - 0.3)
    axes.set_xticks([])
    axes.invert_yaxis()
    axes.legend(fontsize=8, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
    return _pixels(figure)


def _hand_picked(adr: CameraAdr, dimension: Dimension) -> tuple[float, float]:
    """The ends of the camera's own range, as shares of the limits."""
    scale = CAMERA_EFFECTS[dimension.effect].parameter(dimension.parameter).scale
    limits = Range(dimension.low, dimension.high)
    low, high = (limits.position(end, scale) for end in adr.camera.ranges[dimension.effect].ranges[dimension.parameter])
    return low, high


def _pixels(figure: Figure) -> Tensor:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return torch.from_numpy(np.asarray(canvas.buffer_rgba())[..., :3].copy()).movedim(-1, 0).float() / 255
