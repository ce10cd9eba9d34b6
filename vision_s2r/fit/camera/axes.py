"""Where in a picture a gap lies: the divisions of its pixels that a report may name."""

import numpy as np
import torch
from torch import Tensor

from vision_s2r.fit.camera.scoring import BLOCK
from vision_s2r.fit.case import Axis, Samples

_RINGS = 5
_BRIGHTNESS = ("0 to 51", "51 to 102", "102 to 153", "153 to 204", "204 to 255")
_CHANNELS = ("red", "green", "blue")
_BANDS = ("below 0.15 cycles/px", "0.15 to 0.3 cycles/px", "above 0.3 cycles/px")
_LEAST_USUAL = 0.01  # share of a picture's waves: less is what its noise has


def samples(
    error: Tensor, floor: Tensor, residual: Tensor, brightness: Tensor, counted: Tensor, labels: np.ndarray | None
) -> Samples:
    """Samples of frames: every second pixel's `error` and `floor` [N, C, H, W], and every 8 px block's frequencies.

    `residual` is the signed one, `brightness` the real picture's; pixels outside `counted` [N, 1, H, W] take no part.
    A gap that is as large everywhere has the frequencies of the pictures, which are mostly low.
    """
    count, channels, height, width = error.shape
    rows, columns = np.arange(0, height, 2), np.arange(0, width, 2)
    grid = np.ix_(np.arange(count), np.arange(channels), rows, columns)
    chosen = np.broadcast_to(counted.numpy(), error.shape)[grid]
    segment, channel, row, column = (
        index[chosen] for index in np.meshgrid(range(count), range(channels), rows, columns, indexing="ij")
    )
    radius = np.hypot(row - (height - 1) / 2, column - (width - 1) / 2) / np.hypot(height - 1, width - 1) * 2
    pixel_axes = [
        Axis("radius", _ring_labels(), (radius * _RINGS).astype(int).clip(0, _RINGS - 1)),
        Axis("region", _region_labels(), (row * 3 // height) * 3 + column * 3 // width),
        Axis("grid", _grid_labels(), (row * 8 // height) * 8 + column * 8 // width),
        Axis("brightness", _BRIGHTNESS, (brightness.numpy()[grid][chosen] * 5).astype(int).clip(0, 4)),
    ]
    if channels == 3:
        pixel_axes.append(Axis("channel", _CHANNELS, channel))
    if labels is not None:
        ids = np.unique(labels)
        found = np.searchsorted(ids, labels[segment, row, column])
        pixel_axes.append(Axis("class", tuple(f"class {each}" for each in ids), found))
    bands = _bands(residual, floor, counted)
    pixels, waves = len(segment), len(bands[0])
    axes = [Axis(axis.name, axis.labels, np.concatenate([axis.bins, np.full(waves, -1)])) for axis in pixel_axes]
    own = _bands(brightness, torch.zeros_like(floor), counted)
    usual = np.bincount(own[3][own[3] >= 0], own[0][own[3] >= 0], len(_BANDS))
    usual = np.maximum(usual / max(usual.sum(), 1e-12), _LEAST_USUAL)
    bins = np.concatenate([np.full(pixels, -1), bands[3]])
    axes.append(Axis("frequency", _BANDS, bins, tuple((usual / usual.sum()).tolist())))
    return Samples(
        np.concatenate([error.numpy()[grid][chosen], bands[0]]).astype(np.float64),
        np.concatenate([floor.numpy()[grid][chosen], bands[1]]).astype(np.float64),
        np.concatenate([segment, bands[2]]),
        tuple(axes),
    )


def _bands(residual: Tensor, floor: Tensor, counted: Tensor) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Squared cosine coefficients of the blocks that count whole: error, floor, segment and band of each.

    The means of blocks are in no band, -1: they are light and colour, which have axes of their own.
    """
    height, width = (size // BLOCK * BLOCK for size in residual.shape[-2:])

    def blocks(values: Tensor) -> Tensor:
        cut = values[..., :height, :width].mean(1)
        return cut.unfold(1, BLOCK, BLOCK).unfold(2, BLOCK, BLOCK)

    whole = blocks(counted.float()).amin((-1, -2)) > 0
    index = torch.arange(BLOCK)
    cosine = torch.cos(torch.pi / (2 * BLOCK) * (2 * index + 1) * index[:, None]) * (2 / BLOCK) ** 0.5
    cosine[0] /= 2**0.5
    waves = (cosine @ blocks(residual) @ cosine.T).square()[whole]
    noise = blocks(floor).mean((-1, -2))[whole] / residual.shape[1]  # of the mean over channels
    segment = whole.nonzero()[:, 0]
    frequency = torch.hypot(index[:, None].float(), index.float()) / (2 * BLOCK)
    band = torch.bucketize(frequency, torch.tensor([0.01, 0.15, 0.3])) - 1
    shape = waves.shape
    return (
        waves.reshape(-1).numpy(),
        noise[:, None, None].expand(shape).reshape(-1).numpy(),
        segment[:, None, None].expand(shape).reshape(-1).numpy(),
        band.expand(shape).reshape(-1).numpy(),
    )


def _ring_labels() -> tuple[str, ...]:
    return tuple(f"r from {k / _RINGS:.1f} to {(k + 1) / _RINGS:.1f} of the corner's" for k in range(_RINGS))


def _region_labels() -> tuple[str, ...]:
    return tuple(
        f"{down} {across}".replace("middle middle", "centre")
        for down in ("top", "middle", "bottom")
        for across in ("left", "middle", "right")
    )


def _grid_labels() -> tuple[str, ...]:
    return tuple(f"row {row + 1}, column {column + 1} of 8 x 8" for row in range(8) for column in range(8))
