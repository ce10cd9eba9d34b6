"""What a camera effect is, and what it may know of the picture that it is given."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import torch
from torch import Tensor

from vision_s2r.effects import Effect, Registry, Source

Interpolation = Literal["bicubic", "bilinear"]
JpegForm = Literal["codec", "differentiable"]
Encoding = Literal["srgb", "linear"]


@dataclass(frozen=True)
class Frame:
    """A batch of B pictures, apart from their pixels.

    The picture is height x width; its canvas is `margin` pixels wider on each side. Pixel centres lie at
    integers, (0, 0) being the first pixel of the picture, whatever the margin.
    """

    height: int
    width: int
    margin: int
    intrinsics: Tensor  # [B, 4]: fx, fy, cx, cy in pixels of the picture
    seeds: Tensor  # [B] int64, in [0, 2**31), on the CPU: what noise is a function of
    interpolation: Interpolation
    jpeg: JpegForm

    def select(self, index: Tensor) -> "Frame":
        """The frame of these samples; `index` [K] int64 on the CPU."""
        return replace(self, intrinsics=self.intrinsics[index.to(self.intrinsics.device)], seeds=self.seeds[index])

    def pixels(self) -> tuple[Tensor, Tensor]:
        """Coordinates x [1, W+2m] and y [H+2m, 1] of the canvas in pixels of the picture."""
        like = self.intrinsics
        x = torch.arange(-self.margin, self.width + self.margin, dtype=like.dtype, device=like.device)
        y = torch.arange(-self.margin, self.height + self.margin, dtype=like.dtype, device=like.device)
        return x[None, :], y[:, None]

    def from_centre(self) -> tuple[Tensor, Tensor]:
        """As `pixels`, counted from the centre of the picture."""
        x, y = self.pixels()
        return x - (self.width - 1) / 2, y - (self.height - 1) / 2

    def along(self, angle: Tensor) -> Tensor:
        """Distance [B, 1, H+2m, W+2m] (px) from the centre along `angle` [B] (deg, right towards down)."""
        x, y = self.from_centre()
        direction = torch.deg2rad(angle)[:, None, None, None]
        return torch.cos(direction) * x + torch.sin(direction) * y


class CameraEffect(Effect, ABC):
    """An effect of the real camera on a batch of pictures.

    To add one: a class in a file of `vision_s2r/camera/effects`, decorated with `CAMERA_EFFECTS.register`; and what
    fitting needs of it, a `CameraFit` in `fit/camera/effects`.
    """

    source: ClassVar[Source] = "camera"
    order: ClassVar[int]  # where on the light's way: a frame passes the effects by increasing order
    optical: ClassVar[bool]  # sees the margin; else it acts on the sensor's picture, without margin
    linear_light: ClassVar[bool]  # is given pixels in linear light; else coded

    @abstractmethod
    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        """The effect on pictures [B, 3, H+2m, W+2m] in [0, 1], each parameter a tensor [B] of their type.

        The caller clips the result to [0, 1]. No sample is at the neutral value, except where a parameter
        wants a gradient. A sample's result depends on nothing but its own pixels, values and frame.
        """


CAMERA_EFFECTS: Registry[CameraEffect] = Registry("camera")


def per_image(values: Tensor) -> Tensor:
    """[B] to [B, 1, 1, 1], to broadcast over pictures."""
    return values[:, None, None, None]


def straight_through(value: Tensor, smooth: Tensor) -> Tensor:
    """`value` forwards, the gradient of `smooth` backwards (Bengio et al. 2013, arXiv:1308.3432)."""
    return smooth + (value - smooth).detach() if smooth.requires_grad else value
