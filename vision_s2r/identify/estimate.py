"""Parameters with how sure they are, whatever the method."""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from vision_s2r.fit.case import Hypothesis, Intervals

Label: TypeAlias = tuple[str, str]  # effect, parameter
Offsets: TypeAlias = dict[str, list[tuple[float, float, float]]]  # by effect: value, and its 95 % interval


@dataclass(frozen=True)
class ParameterEstimates:
    """The effects of a joint that were identified."""

    hypothesis: Hypothesis
    intervals: Intervals  # 95 %, by effect and parameter
    labels: tuple[Label, ...]  # [K] of the covariance
    covariance: np.ndarray  # [K, K] of the parameters in their own units, of a normal distribution with these intervals
    # Of several recordings, how much more bias torque, or position offset, those after the first have [R - 1].
    offsets: Offsets = field(default_factory=dict)
    # Whether the fit leaves more than noise, and intervals are those of what another motion would find.
    elsewhere: bool = False

    @property
    def values(self) -> np.ndarray:
        """[K], as `labels` has them."""
        return np.array([self.hypothesis.values[effect][parameter] for effect, parameter in self.labels])

    @property
    def correlation(self) -> np.ndarray:
        """[K, K]."""
        deviation = np.sqrt(np.diag(self.covariance))
        return self.covariance / np.maximum(np.outer(deviation, deviation), 1e-300)


def offsets(values: np.ndarray, reaches: np.ndarray) -> list[tuple[float, float, float]]:
    """Values [K], and intervals that reach so far to either side [K]."""
    return [(float(x), float(x - r), float(x + r)) for x, r in zip(values, reaches, strict=True)]


def title(label: Label) -> str:
    """A parameter's name among others: its effect's where that has no other."""
    effect, parameter = label
    return effect if parameter == "value" else f"{effect}.{parameter}"
