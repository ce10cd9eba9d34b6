"""Something unknown beside a joint's effects: a Gaussian process over everything that is measured.

Where a simulator lacks what no effect is, its parameters are fitted beside a discrepancy (Kennedy and O'Hagan,
Journal of the Royal Statistical Society B 63, 2001). Here that is every flexible unknown of `discrepancy.py` at once,
each a smooth function that is small a priori. How large it may be is what makes the recording likeliest (MacKay, Neural
Computation 4, 1992): most vanish. The *evidence* of a set of effects is the likelihood with the discrepancy integrated
out, by Laplace's approximation. An effect that is there spares the discrepancy work: what is left for that is smaller,
or nothing, where one without the effect has to be large and bent, even if it can do all of the effect's work.

What no smooth function is may be integrated out beside them, as torques of their own instants (`disturbance.py`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vision_s2r.fit.case import NOMINAL, Hypothesis, Names, Segments
from vision_s2r.fit.coordinates import Setting
from vision_s2r.fit.joint.discrepancy import DISCREPANCIES, MEANINGS
from vision_s2r.fit.joint.disturbance import DISTURBANCE, GAINS, beside
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.fitter import Floor, JointFitter, names_of
from vision_s2r.fit.joint.noise import memory
from vision_s2r.fit.joint.space import JointSpace
from vision_s2r.fit.likelihood import influence, profile
from vision_s2r.fit.selection import EVIDENCE, SCALE, WORK

ALL: Names = frozenset(MEANINGS)  # the processes: names that have all of these are fitted so
VARIANCES = "variances"  # key of a hypothesis' extra: of each process that is not nothing

MEMORY = 3.0  # knots over which heights go together
FEW = 4  # coefficients that are no function over an axis, and do not go together
# Variances in squares of a height that would be plainly visible.
FIRST, AGAIN, NOTHING, LEAST, MOST = 0.01, 1e-4, 1e-7, 1e-9, 10.0
ROUNDS, SETTLED = 5, 0.3  # of linearization; nats that one has to gain to be followed by another
SLIGHT = 1e-9  # curvature
TURNS, ALIKE = 60, 0.03  # of variances; change of their logarithm at which they have settled
KEPT = 4  # linear problems
PARTS = (1.0, 0.5, 0.2, 0.05)  # of a step, the first that goes downhill is taken


class _Layout:
    """The coordinates of a space that has processes: which is whose, and in what unit."""

    def __init__(self, space: JointSpace, centre: np.ndarray) -> None:
        self.space, self.centre = space, centre
        owner = np.array(space.owner)
        sizes = {each.name: each.scale for each in space.discrepancies if each.name in ALL}
        self.heights = {name: np.flatnonzero(owner == name) for name in sizes}
        self.unit = np.array([sizes.get(name, 1.0) for name in space.owner])
        self.others = np.flatnonzero(~np.isin(owner, list(sizes)))
        self.kernels = {name: _kernel(len(at)) for name, at in self.heights.items()}
        self.inverses = {name: np.linalg.inv(kernel) for name, kernel in self.kernels.items()}

    def precision(self, variances: Mapping[str, float], stiffness: np.ndarray) -> np.ndarray:
        """The prior's [D, D], of coordinates in their units; `stiffness` [D] is that of the others."""
        found = np.zeros((len(self.unit), len(self.unit)))
        found[self.others, self.others] = stiffness[self.others]
        for name, at in self.heights.items():
            found[np.ix_(at, at)] = self.inverses[name] / variances[name]
        return found

    def covariance(self, variances: Mapping[str, float]) -> np.ndarray:
        """The prior's [D, D] of the processes' heights; 0 for other coordinates."""
        found = np.zeros((len(self.unit), len(self.unit)))
        for name, at in self.heights.items():
            found[np.ix_(at, at)] = self.kernels[name] * variances[name]
        return found

    def away(self, point: np.ndarray) -> np.ndarray:
        """How far [D], in their units, coordinates are from where the prior has its centre: heights from 0."""
        away = (point - self.centre) / self.unit
        for at in self.heights.values():
            away[at] = point[at] / self.unit[at]
        return away


@dataclass(frozen=True)
class _Linear:
    """The residuals about a point, linear in the coordinates in their units."""

    layout: _Layout
    point: np.ndarray  # [D]
    weight: np.ndarray  # [E, T, channels] root of what each residual counts
    slopes: np.ndarray  # [D, E·T·channels], weighted
    residuals: np.ndarray  # [E·T·channels], weighted
    stiffness: np.ndarray  # [D] of what is believed, in the units' squares

    @cached_property
    def curvature(self) -> np.ndarray:
        """[D, D] of the likelihood."""
        return self.slopes @ self.slopes.T

    @cached_property
    def uphill(self) -> np.ndarray:
        """The likelihood's slope [D] of the cost."""
        return self.slopes @ self.residuals

    def leaving(self, residuals: np.ndarray) -> "_Linear":
        """The same with other residuals; the curvature is theirs, too."""
        found = replace(self, residuals=residuals)
        vars(found)["curvature"] = self.curvature
        return found

    def bend(self, precision: np.ndarray) -> np.ndarray:
        """The curvature [D, D] of likelihood and prior; a coordinate that nothing shows has a little."""
        bend = self.curvature + precision
        bend[np.diag_indices(len(bend))] += SLIGHT * (1 + np.diag(bend))
        return bend

    def step(self, precision: np.ndarray) -> tuple[np.ndarray, float]:
        """The step [D], in units, to the optimum under a prior, and the cost there, nats."""
        away = self.layout.away(self.point)
        downhill = -self.uphill - precision @ away
        step = np.linalg.solve(self.bend(precision), downhill)
        cost = 0.5 * (self.residuals @ self.residuals + away @ precision @ away - downhill @ step)
        return step, float(cost)


class SmoothUnknown:
    """Fits of effects beside the processes."""

    def __init__(self, fitter: JointFitter, floor: Floor, gain: float = 0.0) -> None:
        """`floor` is what the noise of the recording is known to be, `gain` that of a disturbance, 0 where none is."""
        self._fitter, self._floor, self._gain = fitter, floor, gain
        self._inside = fitter.track.segment >= 0  # [E, T]
        self._kept: dict[object, _Linear] = {}
        self._screened: dict[object, tuple[float, Hypothesis]] = {}

    def disturbed(self, names: Names) -> "SmoothUnknown":
        """The same beside a disturbance, of the gain that is likeliest where these effects are all that is known."""
        found = self.fit(names | ALL, NOMINAL)
        space, track = self._fitter.space(names_of(found)), self._fitter.track
        left = self._residuals(space, space.start(found)[None])[0]
        gain = min(GAINS, key=lambda each: self._profile(beside(each, left, track))[1])
        temper = 1 / memory(beside(gain, left, track), track.lengths)
        return SmoothUnknown(self._fitter, Floor(self._floor.scale, temper), gain)

    def fit(self, names: Names, start: Hypothesis) -> Hypothesis:
        """The likeliest values of these effects and of the processes, from the whole recording; with their evidence.

        Processes that turn out to be nothing are left out. Effects that `start` has not begin at their first start.
        """
        known = start.extra.get(VARIANCES)
        variances = {name: FIRST if known is None else max(known.get(name, 0.0), AGAIN) for name in ALL}
        names -= {DISTURBANCE}
        found = self._filled(names, start)
        for _ in range(ROUNDS):
            variances = {name: variance for name, variance in variances.items() if variance > NOTHING}
            linear = self._linear(names - ALL | variances.keys(), found)
            variances, step = _likeliest(linear, variances)
            point, cost, gained = self._downhill(linear, variances, step)
            found = linear.layout.space.hypothesis(point, {})
            if gained < SETTLED and all(variance > NOTHING for variance in variances.values()):
                break
        return self._with_evidence(linear.layout.space, point, variances, -cost - _complexity(linear, variances))

    def _downhill(
        self, linear: _Linear, variances: Mapping[str, float], step: np.ndarray
    ) -> tuple[np.ndarray, float, float]:
        """The point [D] that the step, or a part of it, leads to, its cost, and what was gained, nats."""
        space, before = linear.layout.space, self._cost(linear, linear.point, variances)
        for part in PARTS:
            point = np.clip(linear.point + part * step * linear.layout.unit, space.low, space.high)
            cost = self._cost(linear, point, variances)
            if cost < before:
                return point, cost, before - cost
        return linear.point, before, 0.0

    def part(self, whole: Hypothesis, segments: Segments) -> Hypothesis:
        """The fit of all segments moved to some of them: one step, the variances being known."""
        linear = self._about(whole)
        inside = np.isin(self._fitter.track.segment, list(segments))[..., None]
        counted = np.broadcast_to(inside, linear.weight.shape).ravel()
        some = replace(linear, slopes=linear.slopes * counted, residuals=linear.residuals * counted)
        space, variances = linear.layout.space, whole.extra[VARIANCES]
        step, _ = some.step(linear.layout.precision(variances, linear.stiffness))
        point = np.clip(linear.point + step * linear.layout.unit, space.low, space.high)
        return self._with_evidence(space, point, variances, whole.extra[EVIDENCE])

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, tuple[float, Hypothesis]]:
        """About how many nats of evidence each name would gain beside these processes, and where its fit may begin.

        Each start is simulated. All other coordinates make up for it as far as they can, to first order, and the
        processes are as large as is likeliest then.
        """
        variances: Mapping[str, float] = hypothesis.extra[VARIANCES]
        here = (self._key(hypothesis), tuple(sorted(variances.items())))
        new = [name for name in names if (here, name) not in self._screened]
        if new:
            linear = self._about(hypothesis)
            row = linear.layout.space.row(linear.point)
            left = self._fitter.residuals(hypothesis, range(self._fitter.count))
            now = _evidence(linear, variances)[0]
            for name in new:
                starts = JOINT_FITS[name].starts(self._fitter.track, row, left)
                self._screened[here, name] = self._best_start(hypothesis, linear, now, name, starts)
        return {name: self._screened[here, name] for name in names}

    def _best_start(
        self, hypothesis: Hypothesis, linear: _Linear, now: float, name: str, starts: Sequence[Setting]
    ) -> tuple[float, Hypothesis]:
        """What one more name gains over the evidence `now` from its best start, and that; none gains, and as it is."""
        best = 0.0, hypothesis
        space = self._fitter.space(names_of(hypothesis) | {name})
        for setting in starts:
            there = space.start(Hypothesis({**hypothesis.values, name: setting}, hypothesis.extra))
            residuals = (self._residuals(space, there[None])[0] * linear.weight).ravel()
            evidence, step, likeliest = _evidence(linear.leaving(residuals), hypothesis.extra[VARIANCES])
            if evidence - now > best[0]:
                there[[owner != name for owner in space.owner]] += step * linear.layout.unit
                there = np.clip(there, space.low, space.high)
                best = evidence - now, space.hypothesis(there, {VARIANCES: likeliest})
        return best

    # -- one round

    def _residuals(self, space: JointSpace, points: np.ndarray) -> np.ndarray:
        left = self._fitter.observer.residuals(space, points, range(len(self._fitter.track.lengths)))
        return beside(self._gain, left, self._fitter.track)

    def _profile(self, residuals: np.ndarray) -> tuple[np.ndarray, float]:
        """The likeliest scale² [channels] of residuals [E, T, channels], and their negative log-likelihood, nats."""
        scale, cost = profile(residuals[None], self._inside.astype(float), self._floor.scale)
        return scale[0], float(cost[0] @ self._floor.temper)

    def _linear(self, names: Names, hypothesis: Hypothesis) -> _Linear:
        """The linear problem of these names at a hypothesis."""
        space = self._fitter.space(names)
        point = space.start(hypothesis)
        layout = _Layout(space, space.believed(point))
        track = self._fitter.track
        alone = self._fitter.observer.linearized(space, point, range(len(track.lengths)))
        here, slopes = (beside(self._gain, each, track) for each in alone)
        weight = np.sqrt(influence(here, self._profile(here)[0]) * self._floor.temper * self._inside[..., None])
        slopes = slopes * layout.unit[:, None, None, None] * weight
        slopes = slopes.reshape(len(point), -1)
        slopes[~np.isfinite(slopes).all(axis=1)] = 0.0  # a step from there runs away
        stiffness = space.stiffness(point, layout.centre) * layout.unit**2
        return _Linear(layout, point, weight, slopes, (here * weight).ravel(), stiffness)

    def _about(self, hypothesis: Hypothesis) -> _Linear:
        """The linear problem at a hypothesis, which folds and screens share: the last ones are kept."""
        key, kept = self._key(hypothesis), self._kept
        if key not in kept:
            found = self._linear(names_of(hypothesis), hypothesis)
            self._kept = dict([*kept.items(), (key, found)][-KEPT:])
            return found
        return kept[key]

    def _key(self, hypothesis: Hypothesis) -> object:
        names = names_of(hypothesis)
        return names, self._fitter.space(names).start(hypothesis).tobytes()

    def _cost(self, linear: _Linear, point: np.ndarray, variances: Mapping[str, float]) -> float:
        """Negative log-likelihood and prior of a point, nats."""
        layout = linear.layout
        away, precision = layout.away(point), layout.precision(variances, linear.stiffness)
        return self._profile(self._residuals(layout.space, point[None])[0])[1] + 0.5 * float(away @ precision @ away)

    def _filled(self, names: Names, start: Hypothesis) -> Hypothesis:
        """The start with a value for every effect of the names, and the processes that it has."""
        fitter, known = self._fitter, start.only(names - ALL)
        missing = names - names_of(known) - frozenset(DISCREPANCIES) - fitter.assumed
        extra = {key: value for key, value in start.extra.items() if key in DISCREPANCIES}
        if not missing:
            return Hypothesis(known.values, extra)
        space, left = fitter.space(names_of(known)), fitter.residuals(known, range(fitter.track.count))
        row = space.row(space.start(known))
        values = {name: JOINT_FITS[name].starts(fitter.track, row, left)[0] for name in missing}
        return Hypothesis({**known.values, **values}, extra)

    def _with_evidence(
        self, space: JointSpace, point: np.ndarray, variances: Mapping[str, float], evidence: float
    ) -> Hypothesis:
        """The hypothesis at a point, with what is known of the processes that are not nothing."""
        scale, likelihood = self._profile(self._residuals(space, point[None])[0])
        there = {name: variance for name, variance in variances.items() if variance > NOTHING}
        disturbed = {DISTURBANCE: self._gain} if self._gain else {}
        found = space.hypothesis(
            point, {SCALE: scale, VARIANCES: there, EVIDENCE: evidence, WORK: -evidence - likelihood, **disturbed}
        )
        return Hypothesis(found.values, {k: v for k, v in found.extra.items() if k not in ALL or k in there})


def prior(variances: Mapping[str, float], space: JointSpace) -> np.ndarray:
    """The precision [D, D] of processes' heights in a space, in its own units; 0 for other coordinates."""
    layout = _Layout(space, np.zeros(space.size))
    scaled = layout.precision(variances, np.zeros(space.size))
    return scaled / layout.unit / layout.unit[:, None]


def _likeliest(linear: _Linear, variances: Mapping[str, float]) -> tuple[dict[str, float], np.ndarray]:
    """The variances of most evidence in the linear problem (MacKay's updates), and the step [D] that goes with them."""
    layout, found = linear.layout, dict(variances)
    away = layout.away(linear.point)
    for _ in range(TURNS):
        precision = layout.precision(found, linear.stiffness)
        step, _ = linear.step(precision)
        spread = np.linalg.inv(linear.bend(precision))
        change = 0.0
        for name, at in layout.heights.items():
            if found[name] <= LEAST:
                continue
            heights, inverse = away[at] + step[at], layout.inverses[name]
            told = len(at) - np.trace(inverse @ spread[np.ix_(at, at)]) / found[name]  # heights that the data tell
            new = float(np.clip(heights @ inverse @ heights / max(told, 1e-3), LEAST, MOST))
            if max(new, found[name]) > NOTHING:
                change = max(change, abs(np.log(new / found[name])))
            found[name] = new
        if change < ALIKE:
            break
    return found, step


def _evidence(linear: _Linear, variances: Mapping[str, float]) -> tuple[float, np.ndarray, dict[str, float]]:
    """The most evidence in the linear problem, nats; the step [D] to its optimum, and its variances."""
    likeliest, step = _likeliest(linear, variances)
    cost = linear.step(linear.layout.precision(likeliest, linear.stiffness))[1]
    return -cost - _complexity(linear, likeliest), step, likeliest


def _complexity(linear: _Linear, variances: Mapping[str, float]) -> float:
    """What heights that a process could have had cost it: half the log-determinant of curvature beside prior, nats."""
    at = np.setdiff1d(np.arange(len(linear.point)), linear.layout.others)
    whole = linear.curvature[np.ix_(at, at)] @ linear.layout.covariance(variances)[np.ix_(at, at)]
    return 0.5 * float(np.linalg.slogdet(np.eye(len(at)) + whole)[1])


def _kernel(count: int) -> np.ndarray:
    """How heights [K, K] of neighbouring knots go together: an Ornstein-Uhlenbeck process over them."""
    if count <= FEW:
        return np.eye(count)
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return np.exp(-apart / MEMORY) + 1e-6 * np.eye(count)
