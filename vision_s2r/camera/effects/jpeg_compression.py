"""The camera, or its driver, delivers JPEG."""

import math
from collections.abc import Mapping

import cv2
import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from vision_s2r.camera.effect import CAMERA_EFFECTS, CameraEffect, Frame, straight_through
from vision_s2r.effects import Parameter
from vision_s2r.errors import UserError
from vision_s2r.images import to_float, to_uint8

# ITU-T T.81, tables K.1 and K.2: the quantization of luminance and chrominance at quality 50.
_LUMINANCE = [
    [16, 11, 10, 16, 24, 40, 51, 61],
    [12, 12, 14, 19, 26, 58, 60, 55],
    [14, 13, 16, 24, 40, 57, 69, 56],
    [14, 17, 22, 29, 51, 87, 80, 62],
    [18, 22, 37, 56, 68, 109, 103, 77],
    [24, 35, 55, 64, 81, 104, 113, 92],
    [49, 64, 78, 87, 103, 121, 120, 101],
    [72, 92, 95, 98, 112, 100, 103, 99],
]
_CHROMINANCE = [
    [17, 18, 24, 47, 99, 99, 99, 99],
    [18, 21, 26, 66, 99, 99, 99, 99],
    [24, 26, 56, 99, 99, 99, 99, 99],
    [47, 66, 99, 99, 99, 99, 99, 99],
    *[[99] * 8] * 4,
]
# JFIF: full-range YCbCr of ITU-R BT.601.
_TO_YCBCR = [
    [0.299, 0.587, 0.114],
    [-0.168735892, -0.331264108, 0.5],
    [0.5, -0.418687589, -0.081312411],
]


@CAMERA_EFFECTS.register
class JpegCompression(CameraEffect):
    """JPEG, quality (rounded) on libjpeg's scale, chroma 4:2:0. Neutral is an infinite quality: no JPEG.

    Two forms, chosen by the camera. `codec` is libjpeg itself, and passes no gradient. `differentiable` is
    the same arithmetic in torch: roundings pass their gradient straight through. Its gradient in the quality
    is that of a sawtooth: it exists, but a search over qualities is the honest way to fit one.
    """

    name = "jpeg_compression"
    order = 150
    optical = False
    linear_light = False
    parameters = (Parameter("quality", "", low=1.0, high=100.0, neutral=math.inf, moderate=25.0),)

    def apply(self, images: Tensor, values: Mapping[str, Tensor], frame: Frame) -> Tensor:
        if frame.jpeg == "codec":
            return libjpeg(images, values["quality"])
        return differentiable_jpeg(images, values["quality"])


def libjpeg(images: Tensor, quality: Tensor) -> Tensor:
    """Pictures [B, 3, H, W] in [0, 1] encoded and decoded by libjpeg at `quality` [B]; without gradient."""
    decoded = []
    for picture, each in zip(to_uint8(images).cpu().numpy(), quality.tolist(), strict=True):
        options = [cv2.IMWRITE_JPEG_QUALITY, min(round(each), 100)]
        options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420]
        written, code = cv2.imencode(".jpg", picture[..., ::-1], options)
        if not written:
            raise UserError(f"libjpeg cannot encode a picture of shape {picture.shape}")
        decoded.append(np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR))[..., ::-1])
    return to_float(torch.from_numpy(np.stack(decoded))).to(images)


def differentiable_jpeg(images: Tensor, quality: Tensor) -> Tensor:
    """The same in torch, as libjpeg does it: pictures [B, 3, H, W] in [0, 1], `quality` [B]."""
    height, width = images.shape[-2:]
    # libjpeg fills the blocks beyond the picture with its edge; downwards, chroma's own edge once it is halved.
    wider = F.pad(images, (0, -width % 16, 0, height % 2), mode="replicate")
    to_ycbcr = torch.tensor(_TO_YCBCR, dtype=images.dtype, device=images.device)
    # Centred on 0, as the transform wants it: luminance less 128, chrominance without its 128.
    ycbcr = _round(torch.einsum("ij,bjhw->bihw", to_ycbcr, _round(wider * 255)))
    luminance = _quantized(ycbcr[:, :1] - 128, _table(_LUMINANCE, quality))[..., :height, :width]
    chrominance = _quantized(_halved(ycbcr[:, 1:]), _table(_CHROMINANCE, quality))
    chrominance = chrominance[..., : (width + 1) // 2]  # without the filling
    chrominance = F.interpolate(chrominance, scale_factor=2, mode="bilinear", align_corners=False)
    ycbcr = torch.cat([luminance + 128, _round(chrominance[..., :height, :width])], dim=1)
    rgb = torch.einsum("ij,bjhw->bihw", torch.linalg.inv(to_ycbcr), ycbcr)
    return _round(rgb).clamp(0, 255) / 255


def _halved(planes: Tensor) -> Tensor:
    """The mean of 2 x 2 whole numbers, halves rounded down and up in turn along a row, as libjpeg does."""
    mean = F.avg_pool2d(planes, 2)
    bias = torch.tensor([0.25, 0.5], dtype=planes.dtype, device=planes.device).repeat(mean.shape[-1] // 2)
    return straight_through((mean + bias).floor(), mean)


def _quantized(planes: Tensor, table: Tensor) -> Tensor:
    """Planes [B, C, H, 8w], the cosine transform of their blocks quantized by `table` [B, 8, 8]."""
    batch, channels, height, width = planes.shape
    filled = F.pad(planes, (0, 0, 0, -height % 8), mode="replicate")
    cosines = _cosines(planes)
    blocks = filled.reshape(batch, channels, -1, 8, width // 8, 8).transpose(3, 4)
    steps = table[:, None, None, None]
    exact = cosines @ blocks @ cosines.mT
    eighths = straight_through((exact * 8).round() / 8, exact)  # as libjpeg's integer transform delivers them
    levels = eighths / steps
    coefficients = straight_through(levels.sign() * (levels.abs() + 0.5).floor(), levels) * steps
    blocks = cosines.mT @ coefficients @ cosines
    return _round(blocks.transpose(3, 4).reshape(filled.shape)[..., :height, :]).clamp(-128, 127)


def _cosines(like: Tensor) -> Tensor:
    """The orthonormal matrix [8, 8] of the cosine transform, frequencies down."""
    index = torch.arange(8, dtype=like.dtype, device=like.device)
    matrix = torch.cos(math.pi / 16 * (2 * index + 1) * index[:, None]) / 2
    return matrix * torch.where(index[:, None] == 0, math.sqrt(0.5), 1.0)


def _table(base: list[list[int]], quality: Tensor) -> Tensor:
    """libjpeg's quantization steps [B, 8, 8] at `quality` [B] (jpeg_set_quality)."""
    quality = _round(quality).clamp(1, 100)[:, None, None]
    percent = torch.where(quality < 50, 5000 / quality, 200 - 2 * quality)
    percent = straight_through(percent.floor(), percent)
    table = (torch.tensor(base, dtype=quality.dtype, device=quality.device) * percent + 50) / 100
    return straight_through(table.floor(), table).clamp(1, 255)


def _round(values: Tensor) -> Tensor:
    return straight_through(values.round(), values)
