"""Student's distribution of what pictures leave: single pixels are forgiven."""

from torch import Tensor

FREEDOM = 6.0


def forgiving(squared: Tensor) -> Tensor:
    """What residuals count for beside others, from their squares in units of the noise's variance."""
    return (FREEDOM + 1) / (FREEDOM + squared)
