"""Q in QT-Opt's form (Kalashnikov et al. 2018, arXiv:1806.10293): the action added to a map of the whole picture."""

import torch
from torch import Tensor, nn

from vision_s2r.grasp.geometry import closing_line, project
from vision_s2r.grasp.q_function import Encoding, QFunction, convolution

OCTAVES = 2  # of the waves that tell a place, besides its coordinates
PLACE = 2 + 4 * OCTAVES  # numbers that tell a place
ACTION = PLACE + 3  # and a grasp


class TrunkQ(QFunction):
    """A convolutional trunk, an embedding of the action added to every pixel of its map, convolutions to a logit.

    Smaller than the original, with group instead of batch statistics, and with two additions, as our camera and the
    grasp's place vary: the action is told as the camera sees it, and the trunk sees each pixel's coordinates. Both tell
    places by waves too (Tancik et al. 2020, arXiv:2006.10739), without which it learnt less.
    """

    def __init__(self, channels: int, width: int, plane_height: float, front: nn.Module | None = None):
        """`width`: channels of the first layer; the map that the action is added to has twice."""
        super().__init__(plane_height, front)
        wide = 2 * width
        self.trunk = nn.Sequential(
            convolution(channels + PLACE, width, stride=2, kernel=5),
            convolution(width, wide, stride=2),
            convolution(wide, wide),
        )
        self.action = nn.Sequential(nn.Linear(ACTION, wide), nn.ReLU(inplace=True), nn.Linear(wide, wide))
        self.head = nn.Sequential(
            nn.ReLU(inplace=True),
            convolution(wide, wide),
            convolution(wide, wide, stride=2),
            nn.AdaptiveAvgPool2d(3),
            nn.Flatten(),
            nn.Linear(9 * wide, wide),
            nn.ReLU(inplace=True),
            nn.Linear(wide, 1),
        )

    def features(self, images: Tensor, homography: Tensor) -> Tensor:
        rows, columns = (torch.linspace(-1, 1, n, device=images.device) for n in images.shape[-2:])
        y, x = torch.meshgrid(rows, columns, indexing="ij")
        places = _waves(torch.stack([x, y], -1)).movedim(-1, 0)
        return self.trunk(torch.cat([images, places.expand(len(images), -1, -1, -1)], 1))

    def score(self, encoding: Encoding, grasps: Tensor) -> Tensor:
        action = self.action(_in_picture(encoding, grasps))
        joined = encoding.features[:, None] + action[..., None, None]
        return self.head(joined.flatten(0, 1)).view(grasps.shape[:2])


def _in_picture(encoding: Encoding, grasps: Tensor) -> Tensor:
    """[B, K, ACTION]: place in the picture, closing line by the double angle, picture halves that 0.1 m spans.

    The double angle is the same for yaw and yaw + pi.
    """
    height, width = encoding.size
    half = grasps.new_tensor([width - 1, height - 1], dtype=torch.float32) / 2
    place = project(encoding.homography, grasps[..., :2].float()) / half - 1
    x, y = (closing_line(encoding.homography, grasps) / half).unbind(-1)
    squared = x.square() + y.square()
    double_angle = torch.stack([x.square() - y.square(), 2 * x * y], -1) / squared[..., None]
    return torch.cat([_waves(place), double_angle, 0.1 * squared.sqrt()[..., None]], -1)


def _waves(place: Tensor) -> Tensor:
    """[..., PLACE]: coordinates [..., 2] in [-1, 1], and sine and cosine of them at each octave."""
    octaves = [torch.pi * 2**k * place for k in range(OCTAVES)]
    return torch.cat([place, *map(torch.sin, octaves), *map(torch.cos, octaves)], -1)
