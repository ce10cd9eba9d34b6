"""Fits of whole hypotheses: names are added one at a time, each from the best of its starts."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import Generic

import numpy as np

from vision_s2r.fit.case import NOMINAL, Hypothesis, Names
from vision_s2r.fit.likelihood import influence, normal_equations
from vision_s2r.fit.maximum_likelihood import Data, Fitted, Residuals, S, costs, trials

SCALE = "scale"  # key of a hypothesis' extra: the scale² [channels] of its residual
EVIDENCE = "evidence"  # … its log-likelihood, nats, with something unknown beside its effects integrated out
WORK = "work"  # … nats of it that the unknown costs: how far from nothing, and how free to be so, it is
SHIFTS = np.array([1e-6, 1e-2])  # dampings of the step to some of the segments that are tried


class Fitter(ABC, Generic[S]):
    """Maximum likelihood on some segments of a recording."""

    runs: Residuals[S]  # of points of spaces
    count: int  # segments
    assumed: Names = frozenset()  # names that a fit may begin with although its start has them not
    iterations: int  # of what the start has already
    shifts = SHIFTS

    def __init__(self) -> None:
        self._derived: dict[object, tuple[np.ndarray, np.ndarray]] = {}

    @abstractmethod
    def data(self, segments: Iterable[int]) -> Data:
        """The samples of these segments."""

    @abstractmethod
    def space(self, names: Iterable[str]) -> S:
        """The coordinates of these names."""

    @abstractmethod
    def names_of(self, hypothesis: Hypothesis) -> Names:
        """Effects and discrepancies of a hypothesis."""

    @abstractmethod
    def labels(self, data: Data) -> np.ndarray:
        """The segment [E, T] of each of all samples, or -1."""

    @abstractmethod
    def screen(self, hypothesis: Hypothesis, name: str, data: Data) -> tuple[float, Fitted]:
        """One more name, a few iterations from its best starts: what it gains so far, nats, and where it stands."""

    @abstractmethod
    def finish(self, space: S, data: Data, point: np.ndarray, iterations: int | None = None) -> Hypothesis:
        """The optimum next to a point."""

    def fit(self, names: Names, segments: Sequence[int], start: Hypothesis | None) -> Hypothesis:
        """The likeliest hypothesis of these names; from `start` where it has them, else added to it one by one."""
        data, start = self.data(segments), start or NOMINAL
        before = self.names_of(start)
        if names and names == before and len(segments) < self.count:
            return self._shifted(start, segments, data)
        known = names & (before | self.assumed)
        fitted, missing = start.only(known), set(names - known)
        if not missing or known != before:
            space = self.space(known)
            fitted = self.finish(space, data, space.start(fitted), self.iterations)
        while missing:
            screened = {name: self.screen(fitted, name, data) for name in sorted(missing)}
            name = max(screened, key=lambda each: screened[each][0])
            fitted = self.finish(self.space(self.names_of(fitted) | {name}), data, screened[name][1].point)
            missing.remove(name)
        return fitted

    def derived(self, hypothesis: Hypothesis) -> tuple[S, np.ndarray, np.ndarray, np.ndarray]:
        """Space, point, and of each segment curvature [count, D, D] and slope [count, D] of the log-likelihood."""
        space = self.space(self.names_of(hypothesis))
        point = space.start(hypothesis)
        key = (self.names_of(hypothesis), point.tobytes())
        if key not in self._derived:
            labels = self.labels(self.data(range(self.count)))
            self._derived[key] = self._by_label(hypothesis, labels, self.count)
        return space, point, *self._derived[key]

    def _by_label(self, hypothesis: Hypothesis, labels: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Curvature [count, D, D] and slope [count, D] of the log-likelihood of the samples of each label [E, T]."""
        space, data = self.space(self.names_of(hypothesis)), self.data(range(self.count))
        residuals, slopes = self.runs.linearized(space, space.start(hypothesis), data.episodes)
        scale = np.maximum(np.asarray(hypothesis.extra.get(SCALE, data.floor)), data.floor)
        factor = influence(residuals, scale) * data.temper
        return normal_equations(residuals, slopes, factor, labels, count)

    def _shifted(self, hypothesis: Hypothesis, segments: Sequence[int], data: Data) -> Hypothesis:
        """The fit of all segments moved to some of them: one step, with the derivatives that are known already."""
        space, point, curvature, slope = self.derived(hypothesis)
        part = list(segments)
        believed = space.believed(point)
        stiffness = space.stiffness(point, believed)
        bend = curvature[part].sum(axis=0) + np.diag(stiffness)
        pull = slope[part].sum(axis=0) + (believed - point) * stiffness
        tried = np.concatenate([point[None], trials(point, bend, pull, self.shifts, space)])
        values, scales = costs(self.runs, space, data, tried)
        best = int(np.argmin(values + [space.surprise(each, believed) for each in tried]))
        return space.hypothesis(tried[best], {SCALE: scales[best]})
