"""Q(picture, grasp): the logit of the chance that a grasp succeeds. One interface for all its forms."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from torch import Tensor, nn

from vision_s2r.geometry import plane_homography


@dataclass(frozen=True)
class Encoding:
    """What scoring needs of a batch of pictures, computed once."""

    features: Tensor  # [B, C, h, w], what the form makes of the pictures
    homography: Tensor  # [B, 3, 3], from the plane that grasps are seen on to the pictures' pixels
    size: tuple[int, int]  # height and width of the pictures, pixels
    displacements: Tensor | None = None  # of the front's rectifier, where there is one


class GraspScores(NamedTuple):
    """What `QFunction.forward` gives."""

    logits: Tensor  # [B, K]
    displacements: Tensor | None  # as in Encoding


class QFunction(nn.Module, ABC):
    """Logits of success for grasps in pictures whose cameras are known.

    images float [B, C, H, W] in [0, 1], intrinsics [B, 4], extrinsics [B, 4, 4] (world → camera),
    grasps [B, K, 3] (x, y, yaw): `forward` gives GraspScores, the same for yaw and yaw + pi.
    """

    def __init__(self, plane_height: float, front: nn.Module | None):
        """`plane_height` (m): of the world plane on which pictures are measured.

        `front`, where given, turns the pictures into others of the same shape, and the displacements at which it
        sampled them, before Q sees them; it is trained with Q.
        """
        super().__init__()
        self.plane_height = plane_height
        self.front = front

    @abstractmethod
    def features(self, images: Tensor, homography: Tensor) -> Tensor:
        """What a form makes of pictures in [-1, 1] before it knows any grasp: [B, C, h, w]."""

    @abstractmethod
    def score(self, encoding: Encoding, grasps: Tensor) -> Tensor:
        """Logits [B, K] of grasps [B, K, 3] in encoded pictures."""

    def perceive(self, encoding: Encoding, grasps: Tensor) -> list[Tensor]:
        """Activations of Q on encoded pictures, layer by layer, which tell how alike two pictures are to it.

        Here what all grasps share, the features; forms that look at each grasp give what they see there.
        """
        return [encoding.features]

    def encode(self, images: Tensor, intrinsics: Tensor, extrinsics: Tensor) -> Encoding:
        """The part of Q that all grasps in a picture share."""
        homography = plane_homography(intrinsics, extrinsics, self.plane_height)
        images, displacements = (images, None) if self.front is None else self.front(images)
        features = self.features(2 * images - 1, homography)
        return Encoding(features, homography, (images.shape[-2], images.shape[-1]), displacements)

    def forward(self, images: Tensor, intrinsics: Tensor, extrinsics: Tensor, grasps: Tensor) -> GraspScores:
        encoding = self.encode(images, intrinsics, extrinsics)
        return GraspScores(self.score(encoding, grasps), encoding.displacements)


def convolution(inputs: int, outputs: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    """A convolution, a normalization over groups of channels of each sample alone, a rectifier."""
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False),
        nn.GroupNorm(8, outputs),
        nn.ReLU(inplace=True),
    )
