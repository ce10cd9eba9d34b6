"""Fits of a joint's hypotheses: where a name's fit starts, and how far each is followed."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision_s2r import parallel
from vision_s2r.fit.case import Hypothesis, Names
from vision_s2r.fit.joint.discrepancy import DISCREPANCIES, OWN
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.observer import Observer
from vision_s2r.fit.joint.space import JointSpace
from vision_s2r.fit.joint.track import JointTrack
from vision_s2r.fit.least_squares import solved
from vision_s2r.fit.likelihood import influence, profile
from vision_s2r.fit.maximum_likelihood import Data, Fitted, costs, minimize
from vision_s2r.fit.selection import SCALE, Fitter
from vision_s2r.joint import DYNAMICS

FINE_STRIDES = (3.0, 1.0, 0.3)  # over ripples, near the optimum
LONG_STRIDE = 10.0
SOFT = 400.0  # times the floor's variance: blurs ripples
INERT = 1e-3  # of what another start changes: one that changes less tells nothing
FOLLOWED = 2  # starts of an effect that are followed
SCREENED = 8  # effects whose starts are, of those that are screened at once


@dataclass(frozen=True)
class Floor:
    """What the noise of this recording is."""

    scale: np.ndarray  # [channels] scale² of Student's t below which no fit goes
    temper: np.ndarray  # [channels] effective samples a sample


class JointFitter(Fitter[JointSpace]):
    """Maximum likelihood on some segments of a track."""

    assumed = frozenset({*DYNAMICS, "encoder_quantization", *OWN.values()})
    iterations = 10

    def __init__(
        self,
        track: JointTrack,
        observer: Observer,
        floor: Floor,
        grid: Mapping[str, float] | None,  # of the encoder: parameters of encoder_quantization
        repeats: float = 1.0,  # samples that say what one says
        first: Hypothesis | None = None,  # fitted when little was believed
        jobs: int = 1,  # threads that look at names
    ) -> None:
        super().__init__()
        self.runs, self.count = observer, track.count
        self.track, self.observer, self.floor, self.grid = track, observer, floor, grid
        self.repeats, self.first, self._jobs = repeats, first, jobs
        self._screened: dict[object, tuple[float, Fitted]] = {}
        self._started: dict[object, tuple[float, float, list[np.ndarray]]] = {}
        self._sloped: tuple[object, tuple[np.ndarray, np.ndarray]] = None, (np.empty(0), np.empty(0))

    def fit(self, names: Names, segments: Sequence[int], start: Hypothesis | None) -> Hypothesis:
        """The likeliest hypothesis; where there is none to start from, from nominal values and from the first fit.

        What is believed holds a descent from nominal values back behind a bend in the likelihood.
        """
        found = super().fit(names, segments, start)
        if self.first is None or (start and start.values):
            return found
        return min(found, super().fit(names, segments, self.first.only(names)), key=lambda h: self._cost(h, segments))

    def _cost(self, hypothesis: Hypothesis, segments: Sequence[int]) -> float:
        space = self.space(names_of(hypothesis))
        point = space.start(hypothesis)
        likelihood = costs(self.observer, space, self.data(segments), point[None])[0][0]
        return float(likelihood) + space.surprise(point, space.believed(point))

    def data(self, segments: Iterable[int]) -> Data:
        """The samples of these segments, of the episodes that hold them."""
        inside = np.isin(self.track.segment, list(segments))
        episodes = np.flatnonzero(inside.any(axis=1))
        weight = inside[episodes].astype(float)
        return Data(tuple(int(e) for e in episodes), weight, self.floor.scale, self.floor.temper)

    def space(self, names: Iterable[str]) -> JointSpace:
        """The coordinates of these names."""
        return JointSpace(frozenset(names), self.track, self.observer.noise, self.grid, self.repeats)

    def names_of(self, hypothesis: Hypothesis) -> Names:
        """Effects and discrepancies of a hypothesis."""
        return names_of(hypothesis)

    def labels(self, data: Data) -> np.ndarray:
        """The segment [E, T] of each sample, or -1."""
        return self.track.segment

    def gains(self, hypothesis: Hypothesis, names: Sequence[str], segments: Sequence[int]) -> dict[str, float]:
        """About how many nats each name would gain; only the starts of those that seem to gain most are followed."""
        data = self.data(segments)
        before = self.space(names_of(hypothesis))
        here = before.start(hypothesis)
        self._slopes(before, here, names_of(hypothesis), data)  # once: all names ask for them

        def start(name: str) -> float:
            now, least, _ = self._starts(before, here, hypothesis, name, data)
            return now - least

        first = self._of_each(start, names)
        ranked = sorted(names, key=lambda name: (name not in DISCREPANCIES, -first[name]))
        followed = [name for k, name in enumerate(ranked) if name in DISCREPANCIES or k < SCREENED]
        return first | self._of_each(lambda name: self.screen(hypothesis, name, data)[0], followed)

    def _of_each(self, look: Callable[[str], float], names: Sequence[str]) -> dict[str, float]:
        found = parallel.run(look, ((name,) for name in names), self._jobs, threads=True)
        return dict(zip(names, found, strict=True))

    def residuals(self, hypothesis: Hypothesis, segments: Iterable[int]) -> np.ndarray:
        """Residuals [E, T, channels] of the episodes that hold these segments, others zero."""
        space, data = self.space(names_of(hypothesis)), self.data(segments)
        out = np.zeros((*self.track.position.shape, self.observer.channels))
        out[list(data.episodes)] = self.observer.residuals(space, space.start(hypothesis)[None], data.episodes)[0]
        return out

    def shows(self, hypothesis: Hypothesis, name: str, values: dict[str, float], variance: np.ndarray) -> float:
        """Nats that this effect would bring, were it there: what it moves in the residual and others cannot undo."""
        data = self.data(range(self.track.count))
        before = self.space(names_of(hypothesis) - {name})
        here = before.start(hypothesis)
        space = self.space(names_of(hypothesis) | {name})
        there = space.start(Hypothesis({**hypothesis.values, name: values}, hypothesis.extra))
        _, slopes = self._slopes(before, here, names_of(hypothesis) - {name}, data)
        # An effect that is there already, at this size, moves nothing: it is seen beside its absence.
        absent = hypothesis if name in DYNAMICS else hypothesis.only(names_of(hypothesis) - {name})
        base = self.space(names_of(absent))
        now = self.observer.residuals(base, base.start(absent)[None], data.episodes)
        weight = np.sqrt(data.temper / variance) * data.weight[..., None]
        moved = ((self.observer.residuals(space, there[None], data.episodes) - now) * weight).ravel()
        basis = (slopes * weight).reshape(before.size, weight.size).T
        basis = basis / np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
        rest = moved - basis @ solved(basis, moved, 1e-9)
        return 0.5 * float(rest @ rest)

    def finish(self, space: JointSpace, data: Data, point: np.ndarray, iterations: int | None = None) -> Hypothesis:
        """The optimum next to a point."""
        iterations = iterations or 12
        strides = FINE_STRIDES if any(JOINT_FITS[name].rippled for name in space.effects) else (1.0,)
        fitted = minimize(self.observer, space, data, point, iterations, strides)
        if not set(space.effects) <= set(DYNAMICS):  # valleys with kinks in them: what a long stride finds
            longer = minimize(self.observer, space, data, fitted.point, iterations, (LONG_STRIDE,))
            if longer.cost < fitted.cost - 0.1:
                fitted = minimize(self.observer, space, data, longer.point, iterations, strides)
        return space.hypothesis(fitted.point, {SCALE: fitted.scale})

    def screen(self, hypothesis: Hypothesis, name: str, data: Data) -> tuple[float, Fitted]:
        """One more name, a few iterations from its best starts: what it gains so far, nats, and where it stands."""
        before = self.space(names_of(hypothesis))
        here = before.start(hypothesis)
        key = _key(names_of(hypothesis), here, name, data)
        if key not in self._screened:
            space = self.space(names_of(hypothesis) | {name})
            now, _, starts = self._starts(before, here, hypothesis, name, data)
            rippled = name not in DISCREPANCIES and JOINT_FITS[name].rippled
            follow = self._through_ripples if rippled else self._few_iterations
            best = min((follow(space, point, data) for point in starts), key=lambda fitted: fitted.cost)
            self._screened[key] = (now - best.cost, best)
        return self._screened[key]

    def _few_iterations(self, space: JointSpace, point: np.ndarray, data: Data) -> Fitted:
        return minimize(self.observer, space, data, point, 2)

    def _through_ripples(self, space: JointSpace, point: np.ndarray, data: Data) -> Fitted:
        """Positions alone, and blurred: they know little of when exactly an impact was."""
        temper = np.full(len(data.temper), 1e-6)
        temper[0] = data.temper[0]
        positions = replace(data, temper=temper)
        blurred = replace(positions, floor=data.floor * SOFT)
        soft = minimize(self.observer, space, blurred, point, 4, (30.0, 10.0))
        sharp = minimize(self.observer, space, positions, soft.point, 3, (10.0, 3.0))
        values, scale = costs(self.observer, space, data, sharp.point[None])
        return Fitted(sharp.point, float(values[0]), scale[0])

    def _starts(
        self, before: JointSpace, here: np.ndarray, hypothesis: Hypothesis, name: str, data: Data
    ) -> tuple[float, float, list[np.ndarray]]:
        """The cost at the hypothesis, at the best start of one more name, and its best starts.

        Each start is tried with the other coordinates as they are, and moved to where, to first order, they make up
        for as much of its effect as they can.
        """
        key = _key(names_of(hypothesis), here, name, data)
        if key not in self._started:
            space = self.space(names_of(hypothesis) | {name})
            residuals, slopes = self._slopes(before, here, names_of(hypothesis), data)
            scale, cost = profile(residuals[None], data.weight, data.floor)
            now = float(cost[0] @ data.temper)
            if name in DISCREPANCIES:
                self._started[key] = now, now, [space.start(hypothesis)]
            else:
                points = self._grid(before, here, space, hypothesis, name, residuals, data)
                points = self._made_up_for(points, name, before, space, (residuals, slopes), scale[0], data)
                values = costs(self.observer, space, data, points)[0]
                order = np.argsort(values, kind="stable")
                self._started[key] = now, float(values[order[0]]), [points[k] for k in order[:FOLLOWED]]
        return self._started[key]

    def _slopes(self, before: JointSpace, here: np.ndarray, names: Names, data: Data) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and slopes at a point; the last ones are kept, since many names are tried beside it."""
        key, kept = _key(names, here, "", data), self._sloped
        if key != kept[0]:
            kept = self._sloped = key, self.observer.linearized(before, here, data.episodes)
        return kept[1]

    def _made_up_for(
        self,
        points: np.ndarray,
        name: str,
        before: JointSpace,
        space: JointSpace,
        now: tuple[np.ndarray, np.ndarray],  # residuals and slopes without the name
        scale: np.ndarray,
        data: Data,
    ) -> np.ndarray:
        """Starts [C, D] of a name, and beside them the same with the other coordinates moved [2 C, D].

        Without those that change nothing, such as a limit beyond what is reached: no slope leads anywhere from there.
        From a nominal value one does.
        """
        residuals, slopes = now
        weight = np.sqrt(influence(residuals, scale) * data.temper * data.weight[..., None])
        basis = (slopes * weight).reshape(before.size, weight.size)
        after = (self.observer.residuals(space, points, data.episodes) * weight).reshape(len(points), -1)
        change = np.linalg.norm(after - (residuals * weight).ravel(), axis=1)
        telling = (change >= INERT * change.max()) | (name in DYNAMICS)
        points, after = points[telling], after[telling]
        moved = points.copy()
        others = [k for k in range(space.size) if space.owner[k] != name]
        size = np.linalg.norm(basis, axis=1)[:, None] + 1e-300
        scaled = basis / size
        answer = solved(scaled @ scaled.T, scaled @ after.T, 1e-9)
        moved[:, others] -= (answer / size).T
        return np.concatenate([points, np.clip(moved, space.low, space.high)])

    def _grid(
        self,
        before: JointSpace,
        here: np.ndarray,
        space: JointSpace,
        hypothesis: Hypothesis,
        name: str,
        residuals: np.ndarray,
        data: Data,
    ) -> np.ndarray:
        row = before.row(here)
        full = np.zeros((*self.track.position.shape, residuals.shape[-1]))
        full[list(data.episodes)] = residuals
        grid = JOINT_FITS[name].starts(self.track, row, full)
        return np.array([space.start(Hypothesis({**hypothesis.values, name: each}, hypothesis.extra)) for each in grid])


def _key(names: Names, point: np.ndarray, name: str, data: Data) -> object:
    """What the screen of a name beside a point of these names is kept under."""
    return names, point.tobytes(), name, data.episodes, data.weight.tobytes()


def names_of(hypothesis: Hypothesis) -> Names:
    """Effects and discrepancies of a hypothesis."""
    return frozenset(hypothesis.values) | (frozenset(hypothesis.extra) & frozenset(DISCREPANCIES))
