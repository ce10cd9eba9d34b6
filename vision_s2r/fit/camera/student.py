"""Student's distribution of what pictures leave: single pixels are forgiven."""

from collections.abc import Iterable

import numpy as np
import torch
from torch import Tensor

FREEDOM = 6.0

PASSES = 3  # of reweighting
_POINTS, _DESIGN = 120_000, 5_000_000  # values that least squares look at, at most; and as many times coefficients


def forgiving(squared: Tensor) -> Tensor:
    """What residuals count for beside others, from their squares in units of the noise's variance."""
    return (FREEDOM + 1) / (FREEDOM + squared)


def left_by(residual: Tensor, weight: Tensor) -> float:
    """Squares of residuals [B, C, H, W], each as it counts; `weight` [B, 1 or C, H, W]."""
    squared = residual.square() * weight
    return float((squared * forgiving(squared)).double().sum())


class LeastSquares:
    """Coefficients of pictures that make up residuals of a shape [B, C, H, W]; values of weight 0 do not count.

    Of many values some are looked at. `waves` [W, H, W], where given, are what each picture is times.
    """

    def __init__(self, shape: torch.Size, weight: Tensor, pictures: int, waves: Tensor | None = None) -> None:
        root = weight.expand(shape).sqrt()
        most = min(_POINTS, _DESIGN // (pictures * (1 if waves is None else len(waves))))
        counted = (root.reshape(-1) > 0).nonzero()[:, 0]
        self.places = counted[:: max(len(counted) // most, 1)]  # in a picture like the residual, flat
        self._shape, self._scale = shape, root.reshape(-1).index_select(0, self.places)
        self._waves = None if waves is None else torch.stack([self.at(wave) for wave in waves])

    def at(self, values: Tensor) -> Tensor:
        """The values of a picture that broadcasts to the residual, where they are looked at."""
        return values.expand(self._shape).reshape(-1).index_select(0, self.places)

    def solve(self, residual: Tensor, values: Iterable[Tensor], near: np.ndarray | None = None) -> np.ndarray:
        """Coefficients from each picture's values there: wave by wave, of each picture. `near`: those before."""
        design = torch.stack(list(values)) * self._scale
        if self._waves is not None:
            design = (self._waves[:, None] * design).flatten(0, 1)
        target = self.at(residual) * self._scale
        left = torch.zeros_like(target)
        if near is not None:
            left = target - torch.from_numpy(near).float() @ design
        found = torch.zeros(len(design), dtype=torch.float64)
        for _ in range(PASSES if near is None else 1):
            weighed = design * forgiving(left.square())
            matrix = (weighed @ design.T).double()
            ridge = 1e-6 * matrix.diagonal().mean() + 1e-9
            matrix += ridge * torch.eye(len(matrix), dtype=torch.float64)
            found = torch.linalg.solve(matrix, (weighed @ target).double())
            left = target - found.float() @ design
        return found.numpy()
