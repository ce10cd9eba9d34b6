"""Fits of a body's hypotheses: where a name's fit starts, and how far it is followed."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Self

import numpy as np

from vision_s2r.fit.case import Hypothesis, Names
from vision_s2r.fit.contact.discrepancy import MEANINGS, Term
from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactScales
from vision_s2r.fit.contact.predictor import Predictor
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.likelihood import GAUSSIAN
from vision_s2r.fit.maximum_likelihood import Data, Fitted, costs, minimize
from vision_s2r.fit.questions import apart
from vision_s2r.fit.selection import SCALE, SHIFTS, Fitter

FOLLOWED = 1  # starts of an effect that are followed …
LEFT = 1.5  # times the scale² of what is not known: where a fit leaves more, it may have stopped short …
HOPS = (0.5, 0.25, 0.12)  # … and is tried once more from so far away, relative
HALVINGS = 4  # … of what is between two starts, to begin nearer to the likeliest
THINNED = 3  # … chosen by one in so many windows


class ContactFitter(Fitter[ContactSpace]):
    """Maximum likelihood on some episodes of a track."""

    iterations = 10
    shifts = SHIFTS[:1]

    def __init__(
        self, predictor: Predictor, scales: ContactScales, terms: Mapping[str, Term], floor: float, temper: float
    ) -> None:
        super().__init__()
        self.runs, self.count = predictor, len(predictor.track.lengths)
        self.predictor, self.scales, self.terms = predictor, scales, terms
        self.floor, self.temper = np.array([floor]), np.array([temper])
        self._screened: dict[object, tuple[float, Fitted]] = {}

    @classmethod
    def under(
        cls,
        hypothesis: Hypothesis,
        predictor: Predictor,
        scales: ContactScales,
        terms: Mapping[str, Term],
        temper: float,
    ) -> Self:
        """A fitter whose residuals are in units of what is not known under this hypothesis."""
        space = ContactSpace(names_of(hypothesis), scales, terms)
        return cls(predictor.whitened(space, space.start(hypothesis)), scales, terms, GAUSSIAN, temper)

    def data(self, segments: Iterable[int]) -> Data:
        """The rows of these episodes."""
        index = np.flatnonzero(np.isin(self.predictor.episode, list(segments)))
        weight = self.predictor.inside[index].astype(float)
        return Data(tuple(int(w) for w in index), weight, self.floor, self.temper)

    def space(self, names: Iterable[str]) -> ContactSpace:
        """The coordinates of these names."""
        return ContactSpace(frozenset(names), self.scales, self.terms)

    def names_of(self, hypothesis: Hypothesis) -> Names:
        """Effects and terms of a hypothesis."""
        return names_of(hypothesis)

    def labels(self, data: Data) -> np.ndarray:
        """The episode [R, 6·ORDERS] of each residual of each row, or -1."""
        return np.where(data.weight > 0, self.predictor.episode[list(data.episodes), None], -1)

    def by_row(self, hypothesis: Hypothesis) -> tuple[np.ndarray, np.ndarray]:
        """The curvature [R, D, D] and slope [R, D] that `derived` gives of episodes, of rows."""
        weight = self.data(range(self.count)).weight
        labels = np.where(weight > 0, np.arange(len(weight))[:, None], -1)
        return self._by_label(hypothesis, labels, len(weight))

    def gains(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each name would gain, all episodes."""
        data = self.data(range(self.count))
        return {name: self.screen(hypothesis, name, data)[0] for name in names}

    def residuals(self, hypothesis: Hypothesis, segments: Iterable[int]) -> np.ndarray:
        """Whitened residuals [R, 6·ORDERS] of all rows, 0 for those of other episodes."""
        space, data = self.space(names_of(hypothesis)), self.data(segments)
        out = np.zeros(self.predictor.inside.shape)
        point = space.start(hypothesis)[None]
        out[list(data.episodes)] = self.predictor.residuals(space, point, data.episodes)[0, ..., 0]
        return out

    def shows(self, hypothesis: Hypothesis, name: str) -> float:
        """Nats that this effect would bring at a plausible size: what it moves and the others cannot undo."""
        values = {**hypothesis.values, name: CONTACT_FITS[name].plausible(self.scales)}
        return self.apart(hypothesis, Hypothesis(values, hypothesis.extra), names_of(hypothesis) - {name})

    def apart(self, hypothesis: Hypothesis, other: Hypothesis, free: Names) -> float:
        """Nats that tell a hypothesis, whose `free` effects may imitate it, from another."""
        data = self.data(range(self.count))
        base, space = self.space(free), self.space(names_of(other))
        now, slopes = self.predictor.linearized(base, base.start(hypothesis), data.episodes)
        moved = self.predictor.residuals(space, space.start(other)[None], data.episodes)[0] - now
        return apart(np.clip(moved, -5, 5).ravel(), slopes) * float(self.temper[0])

    def finish(self, space: ContactSpace, data: Data, point: np.ndarray, iterations: int | None = None) -> Hypothesis:
        """The optimum next to a point."""
        if space.size == 0:
            _, scales = costs(self.runs, space, data, point[None])
            return space.hypothesis(point, {SCALE: scales[0]})
        fitted = minimize(self.runs, space, data, point, iterations or self.iterations)
        if fitted.scale[0] > LEFT * self.floor[0]:
            hopped = self._hopped(space, data, fitted)
            if not np.array_equal(hopped, fitted.point):
                again = minimize(self.runs, space, data, hopped, iterations or self.iterations)
                fitted = min(fitted, again, key=lambda each: each.cost)
        return space.hypothesis(fitted.point, {SCALE: fitted.scale})

    def _hopped(self, space: ContactSpace, data: Data, fitted: Fitted) -> np.ndarray:
        """A likelier point a large step of one parameter away, or two: which corner hits first makes many optima."""
        point, cost = fitted.point, float(costs(self.runs, space, data, fitted.point[None])[0][0])
        for hop in HOPS:
            for k in range(len(space.coordinates)):
                aside = np.zeros(space.size)
                aside[k] = hop * space.sizes(point)[k]
                around = np.clip([point - aside, point + aside], space.low, space.high)
                tried = costs(self.runs, space, data, around)[0]
                if tried.min() < cost:
                    point, cost = around[int(np.argmin(tried))], float(tried.min())
        return point

    def screen(self, hypothesis: Hypothesis, name: str, data: Data) -> tuple[float, Fitted]:
        """One more name, a few iterations from its best starts: what it gains so far, nats, and where it stands."""
        before = self.space(names_of(hypothesis))
        here = before.start(hypothesis)
        key = (names_of(hypothesis), name, data.episodes, here.tobytes())
        if key not in self._screened:
            space = self.space(names_of(hypothesis) | {name})
            now = float(costs(self.runs, before, data, here[None])[0][0])
            points = self._starts(space, hypothesis, name)
            if len(points) > FOLLOWED:
                some = Data(data.episodes[::THINNED], data.weight[::THINNED], data.floor, data.temper)
                order = np.argsort(costs(self.runs, space, some, points)[0], kind="stable")
                points = np.array([self._nearer(space, some, point, name) for point in points[order[:FOLLOWED]]])
            fits = [minimize(self.runs, space, data, point, 1) for point in points]
            best = min(fits, key=lambda fitted: fitted.cost)
            self._screened[key] = (now - best.cost, best)
        return self._screened[key]

    def _nearer(self, space: ContactSpace, data: Data, point: np.ndarray, name: str) -> np.ndarray:
        """A start nearer to the optimum, along the ways in which the effect's likelihood is a narrow, bent valley."""
        valley = CONTACT_FITS[name].valley
        if valley is None:
            return point
        along = np.array(valley(self.scales))
        ways = np.zeros((len(along), space.size))
        ways[:, space.of(name)] = along
        for halving in range(1, HALVINGS + 1):
            for way in ways / 2**halving:
                around = np.clip([point, point - way, point + way], space.low, space.high)
                point = around[int(np.argmin(costs(self.runs, space, data, around)[0]))]
        return point

    def _starts(self, space: ContactSpace, hypothesis: Hypothesis, name: str) -> np.ndarray:
        if name in MEANINGS:
            return space.start(hypothesis)[None]
        grid = CONTACT_FITS[name].starts(self.scales)
        return np.array([space.start(Hypothesis({**hypothesis.values, name: each}, hypothesis.extra)) for each in grid])


def names_of(hypothesis: Hypothesis) -> Names:
    """Effects and terms of a hypothesis."""
    return frozenset(hypothesis.values) | (frozenset(hypothesis.extra) & frozenset(MEANINGS))
