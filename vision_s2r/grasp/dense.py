"""Q as a map: the picture seen from straight above, and over every place of it a logit for each of some yaws.

Fully convolutional (as Zeng et al. 2018, arXiv:1803.09956, with yaws as channels): one pass scores every grasp, and
what is trained is the map at the labelled grasps.
"""

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from vision_s2r.grasp.config import DenseConfig
from vision_s2r.grasp.geometry import project, sample, window_points, wrap
from vision_s2r.grasp.q_function import Encoding, QFunction, convolution


class DenseQ(QFunction):
    """A U-shaped network on the resampled picture, looked up linearly in place and yaw."""

    def __init__(
        self,
        channels: int,
        width: int,
        cfg: DenseConfig,
        side: float,
        plane_height: float,
        front: nn.Module | None = None,
    ):
        """`width`: channels at full resolution; `side`: of the map, m."""
        super().__init__(plane_height, front)
        self._side, self._cells, self._bins = side, cfg.cells, cfg.yaw_bins
        self.fine = nn.Sequential(convolution(channels, width), convolution(width, width))
        self.middle = nn.Sequential(convolution(width, 2 * width, stride=2), convolution(2 * width, 2 * width))
        self.coarse = nn.Sequential(
            convolution(2 * width, 2 * width, stride=2),
            convolution(2 * width, 2 * width),
            convolution(2 * width, 2 * width),
        )
        self.middle_up = convolution(4 * width, 2 * width)
        self.fine_up = convolution(3 * width, width)
        self.head = nn.Conv2d(width, cfg.yaw_bins, 1)

    def features(self, images: Tensor, homography: Tensor) -> Tensor:
        """The map of logits [B, yaw_bins, cells, cells]: x right, y up, yaw from 0 in steps of pi / yaw_bins."""
        above = window_points(images.new_zeros(len(images), 1, 3), (self._side,) * 2, (self._cells,) * 2)
        fine = self.fine(sample(images, project(homography, above[:, 0])))
        middle = self.middle(fine)
        coarse = self.coarse(middle)
        middle = self.middle_up(torch.cat([middle, _twice(coarse)], 1))
        return self.head(self.fine_up(torch.cat([fine, _twice(middle)], 1)))

    def score(self, encoding: Encoding, grasps: Tensor) -> Tensor:
        x, y, yaw = grasps.float().unbind(-1)
        place = torch.stack([x, -y], -1) * (self._cells / self._side) + (self._cells - 1) / 2
        logits = sample(encoding.features, place[:, None])[:, :, 0].transpose(1, 2)  # [B, K, yaw_bins]
        at = torch.remainder(wrap(yaw) / torch.pi, 1) * self._bins
        lower = at.floor()
        neighbours = torch.stack([lower, lower + 1], -1).long() % self._bins
        low, high = logits.gather(-1, neighbours).unbind(-1)
        return torch.lerp(low, high, at - lower)


def _twice(features: Tensor) -> Tensor:
    return F.interpolate(features, scale_factor=2.0, mode="bilinear", align_corners=False)
