"""The coordinates that a fit of a simulator moves in: parameters, each in the measure that suits it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vision_s2r.effects import Parameter
from vision_s2r.fit.case import Hypothesis

Setting = dict[str, float]  # an effect's parameters by name


ROUNDING = 1e-12  # of a logarithm and its exponential, and more
FREEDOM = 4.0  # of Student's distribution about what is believed, which may be wrong by any factor


@dataclass(frozen=True, kw_only=True)
class ParameterRange:
    """A parameter as the fit sees it: its logarithm or itself, its range here, and a step that changes it little."""

    parameter: str
    low: float
    high: float
    step: float
    log: bool = False
    prior: float = math.inf  # standard deviation about what is believed, or about where it starts if nothing is
    firmer: float = math.inf  # its standard deviation at most, where a simulator is known to lack something
    above: str | None = None  # nominal parameter that this one is measured from

    def coded(self, value: float) -> float:
        """The coordinate of a value."""
        return math.log(max(value, 1e-300)) if self.log else value

    def within(self, parameter: Parameter) -> "ParameterRange":
        """The same range as far as the parameter may go; a logarithm and back must not round past that."""
        if self.above is not None:
            return self
        margin = ROUNDING if self.log else 0.0
        ends = self.coded(parameter.low) + margin, self.coded(parameter.high) - margin
        # A joint that stands still has a range of next to nothing, which may lie outside altogether.
        low, high = (min(max(end, ends[0]), ends[1]) for end in (self.low, self.high))
        return replace(self, low=low, high=high)


def log(parameter: str, low: float, high: float, step: float = 0.003, prior: float = math.inf) -> ParameterRange:
    """The logarithm of a parameter from `low` to `high`; step and prior are relative changes."""
    return ParameterRange(parameter=parameter, low=math.log(low), high=math.log(high), step=step, log=True, prior=prior)


def linear(
    parameter: str, low: float, high: float, scale: float, prior: float = math.inf, above: str | None = None
) -> ParameterRange:
    """A parameter from `low` to `high`, `scale` being a size that would be plainly visible."""
    return ParameterRange(parameter=parameter, low=low, high=high, step=0.003 * scale, prior=prior, above=above)


class Coordinates(ABC):
    """The coordinates of a set of names: D numbers, in bounds, with a step of differences and a prior each."""

    effects: list[str]
    owner: list[str]  # name that each coordinate belongs to
    coordinates: Sequence[ParameterRange]  # of effects' parameters, which come first
    size: int
    low: np.ndarray
    high: np.ndarray
    step: np.ndarray
    prior: np.ndarray  # standard deviation …
    centre: np.ndarray  # … about this; NaN: about where a fit starts
    repeats: np.ndarray  # samples [D] that say what one says, by which the prior counts more

    def believed(self, start: np.ndarray) -> np.ndarray:
        """Where [D] the prior of a fit from this point has its centre."""
        return np.where(np.isnan(self.centre), start, self.centre)

    def surprise(self, point: np.ndarray, centre: np.ndarray) -> float:
        """What the prior about `centre` [D] has against a point [D], nats."""
        squared = ((point - centre) / self.prior) ** 2
        tails = self.repeats * FREEDOM * np.log1p(squared / (self.repeats * FREEDOM))
        return 0.5 * float(np.where(np.isnan(self.centre), squared, tails).sum())

    def stiffness(self, point: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """By how much [D] the prior about `centre` holds a point back, for each unit that it is away."""
        squared = ((point - centre) / self.prior) ** 2
        tails = 1 / (1 + squared / (self.repeats * FREEDOM))
        return np.asarray(np.where(np.isnan(self.centre), 1.0, tails) * self.prior**-2.0)

    def sizes(self, point: np.ndarray) -> np.ndarray:
        """What changes of effects' coordinates [K] at a point are relative to: 1 for a logarithm."""
        return np.array([1.0 if c.log else abs(at) for c, at in zip(self.coordinates, point, strict=False)])

    @abstractmethod
    def start(self, hypothesis: Hypothesis) -> np.ndarray:
        """The point [D] at this hypothesis; what is nominal unless named is nominal. KeyError for what it lacks."""

    @abstractmethod
    def hypothesis(self, point: np.ndarray, extra: Mapping[str, Any]) -> Hypothesis:
        """The hypothesis at a point [D], and what else it is to hold."""

    def differences(self, point: np.ndarray, stride: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """A point [D] and one step along each axis from it [1 + D, D]; the steps [D], back from an upper bound.

        Each is `stride` times as long as its coordinate's own.
        """
        step = self.step * stride
        steps = np.where(point + step > self.high, -step, step)
        return np.concatenate([point[None], point + np.diag(steps)]), steps
