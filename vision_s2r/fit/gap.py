"""How large the gap is, and how far it shrinks, with intervals over episodes or frames."""

from dataclasses import dataclass

import numpy as np

from vision_s2r.statistics import interval

ADEQUATE = 0.10  # `rest` that is at the floor


def rest(excess: np.ndarray) -> float:
    """Excess [segments] over the floor, in units of the noise's variance; about 0 where nothing is left.

    The geometric mean over segments: one in which something else goes wrong does not drown the others.
    """
    return float(np.exp(np.log(excess.clip(1e-12)).mean())) - 1


@dataclass(frozen=True)
class Share:
    """A part of the gap and its 95 % interval."""

    value: float
    ci: tuple[float, float]


@dataclass(frozen=True)
class Gap:
    """Mean squared errors [segments] of the gap's metric on held-out data, and what follows from them."""

    before: np.ndarray  # the simulator as it came
    refitted: np.ndarray  # with its nominal parameters refitted
    after: np.ndarray  # with the diagnosis
    floor: np.ndarray  # measurement noise
    seed: int

    @property
    def left(self) -> float:
        """What of the squared gap is left."""
        return float(self.after.mean() / max(self.before.mean(), 1e-300))

    def shrink(self, end: np.ndarray, start: np.ndarray | None = None) -> Share:
        """(start - end) / (before - floor) in root mean squares, and its interval; start is before unless given."""
        start = self.before if start is None else start

        def statistic(counts: np.ndarray) -> np.ndarray:
            before, floor, first, last = (
                np.sqrt(counts @ error / counts.sum(axis=1)) for error in (self.before, self.floor, start, end)
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.where(before > floor, (first - last) / (before - floor), 0.0)

        segments = len(self.before)
        return Share(float(statistic(np.ones((1, segments)))[0]), interval(statistic, segments, self.seed))

    def share(self, part: np.ndarray) -> Share:
        """A part [segments] of the squared gap over that gap, before less floor."""

        def statistic(counts: np.ndarray) -> np.ndarray:
            whole = counts @ (self.before - self.floor)
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.where(whole > 0, counts @ part / whole, 0.0).clip(0, 1)

        segments = len(part)
        return Share(float(statistic(np.ones((1, segments)))[0]), interval(statistic, segments, self.seed))
