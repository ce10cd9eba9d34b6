"""Q on metric crops: a window of the bin, cut out of the picture and turned into each grasp's frame.

The window goes through the camera, so Q does not depend on where the camera is or how far it zooms, nor on where in
the bin the grasp is. Crops are of raw pixels: convolving the picture first and cropping its features was slower and
no better.
"""

import itertools

from torch import Tensor, nn

from vision_s2r.grasp.config import CropConfig
from vision_s2r.grasp.geometry import project, sample, window_points
from vision_s2r.grasp.q_function import Encoding, QFunction, convolution

SLOPE = 0.1  # of a leaky rectifier, below 0


class CropQ(QFunction):
    """A small convolutional network on the crop of each grasp."""

    def __init__(self, channels: int, width: int, cfg: CropConfig, plane_height: float, front: nn.Module | None = None):
        """`width`: channels of the first layers; the last have twice."""
        super().__init__(plane_height, front)
        self._window = (cfg.window[0], cfg.window[1])
        self._shape = (cfg.resolution[1], cfg.resolution[0])
        cells = cfg.resolution[0] // 4 * (cfg.resolution[1] // 4)
        self.network = nn.Sequential(
            convolution(channels, width, stride=2, kernel=5),
            convolution(width, width),
            convolution(width, 2 * width, stride=2),
            convolution(2 * width, 2 * width),
            nn.Flatten(),
            nn.Linear(2 * width * cells, 2 * width),
            nn.LeakyReLU(SLOPE if cfg.activation == "leaky_relu" else 0.0, inplace=True),
            nn.Linear(2 * width, 1),
        )

    def features(self, images: Tensor, homography: Tensor) -> Tensor:
        """The pictures themselves."""
        return images

    def score(self, encoding: Encoding, grasps: Tensor) -> Tensor:
        crops = self.crops(encoding, grasps)
        return self.network(crops.flatten(0, 1)).view(grasps.shape[:2])

    def perceive(self, encoding: Encoding, grasps: Tensor) -> list[Tensor]:
        """Activations of each convolution [B·K, C, h, w] on the crops of the grasps."""
        found = [self.crops(encoding, grasps).flatten(0, 1)]
        for layer in itertools.takewhile(lambda layer: not isinstance(layer, nn.Flatten), self.network):
            found.append(layer(found[-1]))
        return found[1:]

    def crops(self, encoding: Encoding, grasps: Tensor) -> Tensor:
        """[B, K, C, rows, columns]: the window on each grasp; columns go along its closing axis."""
        points = window_points(grasps, self._window, self._shape)
        crops = sample(encoding.features, project(encoding.homography, points).flatten(1, 2))
        return crops.unflatten(2, (grasps.shape[1], -1)).transpose(1, 2)
