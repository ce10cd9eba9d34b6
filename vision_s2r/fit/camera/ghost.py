"""A second copy of the picture: where it lies."""

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor


@dataclass(frozen=True)
class Ghost:
    """Where the second copy lies, px, beside its strength; turned by half a turn, as between lenses, or not."""

    dx: int
    dy: int
    turned: bool = False

    def of(self, mean: Tensor) -> Tensor:
        return shifted(mean.flip(-2, -1) if self.turned else mean, self.dx, self.dy)


def shifted(pictures: Tensor, dx: int, dy: int) -> Tensor:
    """Pictures moved right by dx and down by dy; edges repeat."""
    pad = max(abs(dx), abs(dy))
    if not pad:
        return pictures
    height, width = pictures.shape[-2:]
    padded = F.pad(pictures, (pad,) * 4, mode="replicate")
    return padded[..., pad - dy : pad - dy + height, pad - dx : pad - dx + width]


def find_ghost(residual: Tensor, mean: Tensor, counted: Tensor) -> Ghost:
    """Where, up to a quarter of the width away, the residual looks most like the picture, as it is or turned.

    As it is, two px away at least.
    """
    height, width = mean.shape[-2:]
    reach = width // 4

    def spectrum(pictures: Tensor) -> Tensor:
        grey = (pictures * counted).mean(1)
        fine = grey - F.avg_pool2d(grey[:, None], 9, 1, padding=4)[:, 0]
        return torch.fft.rfft2(fine, s=(2 * height, 2 * width))

    of_residual = spectrum(residual)

    def likeness(picture: Tensor) -> Tensor:
        of_picture = spectrum(picture)
        power = of_picture.abs().square().sum(0)
        alike = (of_residual * of_picture.conj()).sum(0) / (power + power.mean())
        shifts = torch.roll(torch.fft.irfft2(alike, s=(2 * height, 2 * width)), (reach, reach), (0, 1))
        return shifts[: 2 * reach + 1, : 2 * reach + 1].abs()

    found = torch.stack([likeness(mean), likeness(mean.flip(-2, -1))])
    found[0, reach - 1 : reach + 2, reach - 1 : reach + 2] = 0
    turned, row, column = (int(each) for each in torch.unravel_index(found.argmax(), found.shape))
    return Ghost(column - reach, row - reach, bool(turned))
