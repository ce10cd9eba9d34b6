"""Source pictures as a camera sees them, which may have more pixels than canonical ones, and as networks read them."""

import torch
from torch import Tensor

from vision_s2r.camera.camera import Camera
from vision_s2r.camera.parameters import CameraParameters
from vision_s2r.geometry import enlarged
from vision_s2r.images import reduced, to_float


def side(sources: Tensor, margin: int) -> int:
    """Of the pictures uint8 [B, H+2m, H+2m, 3] without their margin, px: as large as a camera sees them."""
    return sources.shape[1] - 2 * margin


def seen(
    camera: Camera, sources: Tensor, parameters: CameraParameters, margin: int, intrinsics: Tensor, size: int
) -> Tensor:
    """Pictures uint8 [B, H+2m, H+2m, 3] as a camera of H px sees them, float [B, 3, H, H] in [0, 1].

    `parameters`: as drawn for pictures of H px; `intrinsics` [B, 4]: of canonical pictures, which have `size` px.
    """
    larger = enlarged(intrinsics, side(sources, margin) / size)
    return camera(to_float(sources), parameters, margin, larger)


def read(
    camera: Camera, sources: Tensor, parameters: CameraParameters, margin: int, intrinsics: Tensor, size: int
) -> Tensor:
    """What networks of `size` px are given of what `seen` says, float [B, 3, size, size] in [0, 1].

    Always of one layout, channels last: one that was compiled would be compiled again for another.
    """
    given = reduced(seen(camera, sources, parameters, margin, intrinsics, size), size)
    return given.contiguous(memory_format=torch.channels_last)
