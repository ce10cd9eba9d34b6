"""The likeliest parameters of a set of effects: damped Gauss-Newton on the means of the statistics."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from vision_s2r.fit.camera.effect import Optics
from vision_s2r.fit.case import Values
from vision_s2r.fit.gauss_newton import Damping, descend
from vision_s2r.fit.least_squares import solved
from vision_s2r.fit.unpaired.scatter import Scatter
from vision_s2r.fit.unpaired.simulated import SimulatedSet
from vision_s2r.fit.unpaired.space import (
    of_whole,
    pack,
    shown,
    smooth,
    starts,
    stepped,
    steps,
    to_whole,
    unpack,
    wholes,
)

_RULE = Damping(first=1e-3, raised=30, least=0.03, times=4, lowered=10, gain=0.02, relative_gain=1e-3, move=0.02)
FEW = 6  # pictures that differences between cameras are taken from: scenes matter little to a difference


@dataclass(frozen=True)
class UnpairedFitter:
    """Fits cameras to the mean statistics of real pictures.

    `free` [K] bool marks statistics that a flexible unknown moves at will, so that they count for nothing. `pictures`
    is how many independent pictures the comparison is worth, `seen` how many the simulator's means are of; `fixed`
    parameters are known and stay.
    """

    simulated: SimulatedSet
    scatter: Scatter
    optics: Optics
    pictures: float
    seen: int
    fixed: Values

    def mean(self, values: Values) -> np.ndarray:
        """Mean statistics [K] of the simulator's set under effects."""
        return self.simulated.mean(values)

    def like(self, values: Values, base: Values) -> np.ndarray:
        """About the same, from a few pictures, of a camera that differs from `base`."""
        few = self._few()
        changed, before = self.simulated.statistics(values, few), self.simulated.statistics(base, few)
        return self.mean(base) + (changed - before).mean(0)

    def loss(self, difference: np.ndarray, free: np.ndarray) -> float:
        """Minus the log-likelihood (nats) of a difference [K] of mean statistics, those of `free` fitted away."""
        return 0.5 * self.pictures * float((self.rest(difference[None], free) ** 2).sum())

    def fit(
        self, target: np.ndarray, names: Collection[str], free: np.ndarray, start: Values, iterations: int
    ) -> dict[str, dict[str, float]]:
        """Parameters of `names` under which the simulator's set is likeliest to have the means `target` [K]."""
        values = {name: dict(start[name]) for name in names if name in start}
        values |= {name: dict(self.fixed[name]) for name in names if name in self.fixed}
        new = [name for name in names if name not in values]
        values |= {name: starts(name, self.optics.width)[0] for name in sorted(new) if smooth(name)}
        for name in sorted((name for name in new if not smooth(name)), key=lambda name: (shown()[name].turn, name)):
            values = self._started(target, free, values, name)
        for turn in range(2):
            before = values
            values = self._descended(target, free, values, iterations)
            steppers = [name for name in stepped() if name in names and name not in self.fixed]
            for name in steppers:
                values = self._stepped(target, free, values, name)
            if turn or not steppers or values == before:
                break
        return values

    def slopes(self, values: Values, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Change of the means [K, P] with a step of each coordinate, the steps [P], and the longest moves [P]."""
        small, limits = steps(names, self.optics)
        point = pack(values, names)
        base = self.mean(values)
        columns = []
        for k, step in enumerate(small):
            moved = point.copy()
            moved[k] += step
            moved_values = dict(values) | unpack(moved, names)
            columns.append(self.like(moved_values, values) - base)
        return np.array(columns).reshape(len(small), len(base)).T, small, limits

    def gain(self, target: np.ndarray, free: np.ndarray, values: Values, name: str) -> float:
        """About how many nats (not below 0) adding this effect brings."""
        difference = target - self.mean(values)
        now = self.loss(difference, free)
        if smooth(name):
            trial = dict(values) | {name: starts(name, self.optics.width)[0]}
            columns, _, _ = self.slopes(trial, [name])
            moved = solved(*self.equations(columns, difference, free), 1e-12)
            return now - self.loss(difference - columns @ moved, free)
        started = self._started(target, free, dict(values), name)
        return max(now - self.loss(target - self.like(started, values), free), 0.0)

    def effects(self, values: Values, names: Sequence[str]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Whitened, of each of these effects: what losing it changes [K], and its slopes [K, P] (0 where it steps)."""
        free = np.zeros(len(self.mean(values)), dtype=bool)
        lost, slopes = {}, {}
        for name in names:
            without = {key: given for key, given in values.items() if key != name}
            lost[name] = self.rest((self.mean(values) - self.like(without, values))[None], free)[0]
            columns = np.zeros((len(free), 1)) if name in stepped() else self.slopes(values, [name])[0]
            slopes[name] = self.rest(columns.T, free).T
        return lost, slopes

    def _few(self) -> tuple[int, ...]:
        count = len(self.simulated)
        return tuple(sorted({round(k * (count - 1) / (FEW - 1)) for k in range(FEW)}))

    def rest(self, differences: np.ndarray, free: np.ndarray) -> np.ndarray:
        """Whitened differences [..., K] without what `free` statistics can take over."""
        white = self.scatter.whitened(differences)
        if not free.any():
            return white
        taken = self.scatter.whitened(np.eye(len(free))[free]).T
        basis = np.linalg.qr(taken)[0]
        return white - (white @ basis) @ basis.T

    def equations(self, columns: np.ndarray, difference: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whitened columns [K, P] and difference [K]."""
        return self.rest(columns.T, free).T, self.rest(difference[None], free)[0]

    def _started(self, target: np.ndarray, free: np.ndarray, values: Values, name: str) -> dict[str, dict[str, float]]:
        """With the effect at the likeliest of its starts."""
        if name in self.fixed:
            return {**values, name: dict(self.fixed[name])}  # type: ignore[dict-item]
        trials = [{**values, name: start} for start in starts(name, self.optics.width)]
        losses = [self.loss(target - self.like(trial, values), free) for trial in trials]
        return trials[int(np.argmin(losses))]  # type: ignore[return-value]

    def _descended(
        self, target: np.ndarray, free: np.ndarray, values: Values, iterations: int
    ) -> dict[str, dict[str, float]]:
        """Moved to the bottom nearby."""
        now = {name: dict(given) for name, given in values.items()}
        names = sorted(name for name in now if name not in self.fixed and name not in stepped())
        if not names:
            return now
        descent = _Descent(self, target, free, names)
        return descend(descent, descent.at(now), iterations, _RULE, steps(names, self.optics)[1]).values

    def _stepped(self, target: np.ndarray, free: np.ndarray, values: Values, name: str) -> dict[str, dict[str, float]]:
        """With the likeliest whole number of cells, or quality, near that of `values`."""
        width = self.optics.width
        low, high = wholes(name, width)

        def at(whole: int) -> dict[str, dict[str, float]]:
            return {**values, name: of_whole(name, whole, width)}  # type: ignore[dict-item]

        known: dict[int, float] = {}

        def loss(whole: int) -> float:
            if whole not in known:
                known[whole] = self.loss(target - self.mean(at(whole)), free)
            return known[whole]

        best = to_whole(name, values[name], width)
        stride = max(round(best * 0.08), 1)
        while True:
            new = min((whole for whole in (best, best - stride, best + stride) if low <= whole <= high), key=loss)
            if new != best:
                best = new
            elif stride > 1:
                stride //= 2
            else:
                return at(best)


@dataclass(frozen=True)
class _State:
    """Values of a descent."""

    values: dict[str, dict[str, float]]
    cost: float


@dataclass(frozen=True)
class _Descent:
    """Some effects towards the means `target` [K], in steps of their charts."""

    fitter: UnpairedFitter
    target: np.ndarray
    free: np.ndarray
    names: list[str]

    def at(self, values: dict[str, dict[str, float]]) -> _State:
        return _State(values, self.fitter.loss(self.target - self.fitter.mean(values), self.free))

    def equations(self, state: _State) -> tuple[np.ndarray, np.ndarray]:
        columns, _, _ = self.fitter.slopes(state.values, self.names)
        matrix, vector = self.fitter.equations(columns, self.target - self.fitter.mean(state.values), self.free)
        return matrix.T @ matrix + 1e-12 * np.eye(len(matrix.T)), matrix.T @ vector

    def step(self, state: _State, step: np.ndarray) -> _State:
        small = steps(self.names, self.fitter.optics)[0]
        here = pack(state.values, self.names)
        return self.at(state.values | unpack(here + step * small, self.names))
