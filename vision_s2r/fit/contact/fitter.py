"""Fits of whole hypotheses: names are added one at a time, each from the best of its starts."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np

from vision_s2r.fit.case import NOMINAL, Hypothesis, Names
from vision_s2r.fit.contact.discrepancy import MEANINGS, Term
from vision_s2r.fit.contact.effect import CONTACT_FITS, Scales
from vision_s2r.fit.contact.predictor import Predictor
from vision_s2r.fit.contact.space import Space
from vision_s2r.fit.joint.fitting import Data, Fitted, costs, minimize, trials
from vision_s2r.fit.joint.likelihood import influence, normal_equations

SCALE = "scale"  # key of a hypothesis' extra: the scale² [1] of its residual
SHIFTS = np.array([1e-6, 1e-2])  # dampings of the step to some of the segments
FOLLOWED = 1  # starts of an effect that are followed


class Fitter:
    """Maximum likelihood on some episodes of a track."""

    def __init__(
        self, predictor: Predictor, scales: Scales, terms: Mapping[str, Term], floor: float, temper: float
    ) -> None:
        self.predictor, self.scales, self.terms = predictor, scales, terms
        self.floor, self.temper = np.array([floor]), np.array([temper])
        self._runs = cast(Any, predictor)  # as joints' observers do: residuals of points
        self._screened: dict[object, tuple[float, Fitted]] = {}
        self._derived: dict[object, tuple[np.ndarray, np.ndarray]] = {}

    @property
    def segments(self) -> int:
        """Episodes."""
        return len(self.predictor.track.lengths)

    def data(self, segments: Iterable[int]) -> Data:
        """The windows of these episodes."""
        windows = self.predictor.windows
        index = np.flatnonzero(np.isin(windows.episode, list(segments)))
        weight = np.repeat(windows.inside[index], 6, axis=1).astype(float)
        return Data(tuple(int(w) for w in index), weight, self.floor, self.temper)

    def space(self, names: Iterable[str]) -> Space:
        """The coordinates of these names."""
        return Space(frozenset(names), self.scales, self.terms)

    def fit(self, names: Names, segments: Sequence[int], start: Hypothesis | None) -> Hypothesis:
        """The likeliest hypothesis of these names; from `start` where it has them, else added to it one by one."""
        data, start = self.data(segments), start or NOMINAL
        if names and names == names_of(start) and len(segments) < self.segments:
            return self._shifted(start, segments, data)
        known = names & names_of(start)
        fitted, missing = start.only(known), set(names - known)
        if not missing or known != names_of(start):
            space = self.space(known)
            fitted = self._finish(space, data, space.start(fitted))
        while missing:
            screened = {name: self._screen(fitted, name, data) for name in sorted(missing)}
            name = max(screened, key=lambda each: screened[each][0])
            fitted = self._finish(self.space(names_of(fitted) | {name}), data, screened[name][1].point)
            missing.remove(name)
        return fitted

    def gains(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each name would gain, all episodes."""
        data = self.data(range(self.segments))
        return {name: self._screen(hypothesis, name, data)[0] for name in names}

    def residuals(self, hypothesis: Hypothesis, segments: Iterable[int]) -> np.ndarray:
        """Whitened residuals [W, 6·H] of all windows, 0 for those of other episodes."""
        space, data = self.space(names_of(hypothesis)), self.data(segments)
        windows = self.predictor.windows
        out = np.zeros((len(windows.first), 6 * len(windows.steps)))
        point = space.start(hypothesis)[None]
        out[list(data.episodes)] = self.predictor.residuals(space, point, data.episodes)[0, ..., 0]
        return out

    def shows(self, hypothesis: Hypothesis, name: str) -> float:
        """Nats that this effect would bring at a plausible size: what it moves and the others cannot undo."""
        data = self.data(range(self.segments))
        base = self.space(names_of(hypothesis) - {name})
        space = self.space(names_of(hypothesis) | {name})
        here = base.start(hypothesis)
        values = {**hypothesis.values, name: CONTACT_FITS[name].plausible(self.scales)}
        now, slopes = self.predictor.slopes(base, here, data.episodes)
        there = space.start(Hypothesis(values, hypothesis.extra))
        moved = self.predictor.residuals(space, there[None], data.episodes)[0] - now
        basis = slopes.reshape(base.size, -1).T
        basis = basis / np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
        flat = np.clip(moved, -5, 5).ravel()
        rest = flat - basis @ np.linalg.lstsq(basis, flat, rcond=1e-9)[0]
        return 0.5 * float(rest @ rest) * float(self.temper[0])

    def derived(self, hypothesis: Hypothesis) -> tuple[Space, np.ndarray, np.ndarray, np.ndarray]:
        """Space, point, and of each episode curvature [E, D, D] and slope [E, D] of the log-likelihood."""
        space = self.space(names_of(hypothesis))
        point = space.start(hypothesis)
        key = (names_of(hypothesis), point.tobytes())
        if key not in self._derived:
            data = self.data(range(self.segments))
            points, steps = space.differences(point)
            residuals = self.predictor.residuals(space, points, data.episodes)
            scale = np.maximum(np.asarray(hypothesis.extra.get(SCALE, data.floor)), data.floor)
            factor = influence(residuals[0], scale) * data.temper
            label = np.where(data.weight > 0, self.predictor.windows.episode[list(data.episodes), None], -1)
            self._derived[key] = normal_equations(residuals, steps, factor, label, self.segments)
        return space, point, *self._derived[key]

    def _shifted(self, hypothesis: Hypothesis, segments: Sequence[int], data: Data) -> Hypothesis:
        """The fit of all episodes moved to some of them: one step, with the derivatives that are known already."""
        space, point, curvature, slope = self.derived(hypothesis)
        part = list(segments)
        bend = curvature[part].sum(axis=0) + np.diag(space.prior**-2.0)
        tried = np.concatenate([point[None], trials(point, bend, slope[part].sum(axis=0), SHIFTS, cast(Any, space))])
        values, scales = costs(self._runs, cast(Any, space), data, tried)
        best = int(np.argmin(values))
        return space.hypothesis(tried[best], {SCALE: scales[best]})

    def _finish(self, space: Space, data: Data, point: np.ndarray, iterations: int = 7) -> Hypothesis:
        if space.size == 0:
            _, scales = costs(self._runs, cast(Any, space), data, point[None])
            return space.hypothesis(point, {SCALE: scales[0]})
        fitted = minimize(self._runs, cast(Any, space), data, point, iterations)
        return space.hypothesis(fitted.point, {SCALE: fitted.scale})

    def _screen(self, hypothesis: Hypothesis, name: str, data: Data) -> tuple[float, Fitted]:
        """One more name, a few iterations from its best starts: what it gains so far, and where it stands."""
        before = self.space(names_of(hypothesis))
        here = before.start(hypothesis)
        key = (names_of(hypothesis), name, data.episodes, here.tobytes())
        if key not in self._screened:
            space = cast(Any, self.space(names_of(hypothesis) | {name}))
            now = float(costs(self._runs, cast(Any, before), data, here[None])[0][0])
            points = self._starts(space, hypothesis, name)
            if len(points) > FOLLOWED:
                order = np.argsort(costs(self._runs, space, data, points)[0], kind="stable")
                points = points[order[:FOLLOWED]]
            fits = [minimize(self._runs, space, data, point, 1) for point in points]
            best = min(fits, key=lambda fitted: fitted.cost)
            self._screened[key] = (now - best.cost, best)
        return self._screened[key]

    def _starts(self, space: Space, hypothesis: Hypothesis, name: str) -> np.ndarray:
        if name in MEANINGS:
            return space.start(hypothesis)[None]
        grid = CONTACT_FITS[name].starts(self.scales)
        return np.array([space.start(Hypothesis({**hypothesis.values, name: each}, hypothesis.extra)) for each in grid])


def names_of(hypothesis: Hypothesis) -> Names:
    """Effects and terms of a hypothesis."""
    return frozenset(hypothesis.values) | (frozenset(hypothesis.extra) & frozenset(MEANINGS))
