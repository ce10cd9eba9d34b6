"""What machines predict of windows and stretches, set against what was measured, in units of what is not known of it.

Not known are the measured poses (their noise, and how far bodies at rest are off), the first state, which every
prediction carries on (to first order: its covariance through the simulator; and what draws of it leave of that), and
what the simulator's step leaves. All poses of a window are whitened together. Of a stretch all poses are seen as a few
polynomials, and what its first state can do to these, to first order, is left out.
"""

import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.contact import simulate
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.contact.stretches import ORDERS, Stretches, none_of, outside
from vision_s2r.fit.contact.windows import ContactTrack, Windows, difference
from vision_s2r.fit.maximum_likelihood import Residuals

STEP = 0.0025  # s, of the integrator in touch, at most
FINER = 4  # times the steps, for the integrator's own error
DRAWS = 24  # of first states
REMEMBERED = 400  # machines whose residuals are kept
ANYTHING = 100.0  # times the standard deviations of its first state, that one of a stretch may be off
BLIND = 100.0  # of the noise's variance: what is known no better of a stretch does not count
SIMILAR = 1.5  # between the longest and the shortest of stretches that are run together

_Known = OrderedDict[bytes, tuple[np.ndarray, np.ndarray]]  # residuals [R, 6·ORDERS], and of which rows [R] they are


@dataclass(frozen=True)
class Predictor(Residuals[ContactSpace]):
    """Runs points of spaces over R rows of a track: windows, and stretches behind them."""

    track: ContactTrack
    windows: Windows
    stretches: Stretches
    whiten: np.ndarray  # [W, 6·H, 6·H] lower triangles, of residuals by horizon; beyond an episode's end 0
    sieve: np.ndarray  # [S, 6·ORDERS, 6·ORDERS] of a stretch's polynomials, by order; 0 for what does not count
    # By machine, the last asked for last.
    _known: _Known = field(default_factory=OrderedDict, repr=False, compare=False)

    channels = 1  # of the residuals

    @cached_property
    def episode(self) -> np.ndarray:
        """Of each row [R]."""
        return np.concatenate([self.windows.episode, self.stretches.episode])

    @cached_property
    def sample(self) -> np.ndarray:
        """At which each row [R] begins."""
        return np.concatenate([self.windows.sample, self.stretches.sample])

    @cached_property
    def samples(self) -> np.ndarray:
        """Of each row [R], the first included; some of a window may be beyond the end of the episode."""
        return np.concatenate([np.full(len(self.windows.sample), self.windows.samples), self.stretches.count])

    @cached_property
    def inside(self) -> np.ndarray:
        """Which residuals [R, 6·ORDERS] count; a window has fewer."""
        short = np.repeat(self.windows.inside, 6, axis=1)
        beyond = np.zeros((len(short), 6 * ORDERS - short.shape[1]), dtype=bool)
        return np.concatenate([np.concatenate([short, beyond], axis=1), self.sieve.any(axis=2)])

    @property
    def substeps(self) -> int:
        """Steps a sample."""
        return max(1, math.ceil(self.track.sample_time / STEP - 1e-9))

    def residuals(self, space: ContactSpace, points: np.ndarray, rows: Sequence[int]) -> np.ndarray:
        """Whitened residuals [C, R, 6·ORDERS, 1] of points [C, D]; of a machine asked for again, as they were."""
        index, terms = np.asarray(rows), space.terms.array().tobytes()
        keys = [row.tobytes() + terms for row in space.machines(points)]
        count, size = self.inside.shape
        known = {
            key: self._known.pop(key, (np.zeros((count, size)), np.zeros(count, dtype=bool)))
            for key in dict.fromkeys(keys)
        }
        lacking = [key for key, (_, done) in known.items() if not done[index].all()]
        if lacking:  # machines side by side take less than one after the other
            missing = index[~np.all([known[key][1][index] for key in lacking], axis=0)]
            found = self._run_anew(space, points[[keys.index(key) for key in lacking]], missing)
            for key, residuals in zip(lacking, found, strict=True):
                kept, done = (each.copy() for each in known[key])  # another thread may be reading
                kept[missing], done[missing] = residuals, True
                known[key] = kept, done
        self._known.update(known)
        while len(self._known) > max(REMEMBERED, len(known)):
            self._known.popitem(last=False)
        return np.stack([known[key][0][index] for key in keys])[..., None]

    def _run_anew(self, space: ContactSpace, points: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Whitened residuals [C, R, 6·ORDERS] of machines in these rows."""
        windows = len(self.whiten)
        out = np.zeros((len(points), len(index), self.inside.shape[1]))
        of_window = index < windows
        short, long = index[of_window], index[~of_window] - windows
        width = self.whiten.shape[1]
        raw = self.differences(space, points, short).reshape(len(points), len(short), width)
        out[:, of_window, :width] = np.einsum("wij,cwj->cwi", self.whiten[short], raw)
        if len(long):
            seen = self.seen(space, points, long, self.stretches.first[long])
            out[:, ~of_window] = np.einsum("sij,csj->csi", self.sieve[long], seen)
        return out

    def differences(self, space: ContactSpace, points: np.ndarray, index: np.ndarray, finer: int = 1) -> np.ndarray:
        """Measured less predicted poses [C, W, H, 6]."""
        states = self.run(space, points, index, self.windows.first[index], finer)
        return difference(self.windows.measured[index], states)

    def seen(
        self, space: ContactSpace, points: np.ndarray, index: np.ndarray, first: np.ndarray, finer: int = 1
    ) -> np.ndarray:
        """Polynomials [C, S, ORDERS·6] of measured less predicted poses of stretches, from first states [S, 13].

        In units of the noise of poses.
        """
        of = self.stretches.some(index)
        out = np.zeros((len(points), len(index), ORDERS, 6))
        left = np.argsort(of.count, kind="stable")
        while len(left):
            alike = left[of.count[left] <= SIMILAR * of.count[left[0]]]
            left = left[len(alike) :]
            longest = int(of.count[alike].max())
            states = self._states(space, points, first[alike], of.sample[alike], longest, finer)
            apart = difference(of.measured[alike, :longest], np.nan_to_num(states))
            out[:, alike] = of.basis[alike, :, :longest] @ apart
        return np.asarray((out / np.repeat(self.track.states.noise, 3)).reshape(len(points), len(index), -1))

    def run(
        self, space: ContactSpace, points: np.ndarray, index: np.ndarray, first: np.ndarray, finer: int = 1
    ) -> np.ndarray:
        """States [C, W, H, 13] at the horizons of windows, from other first states [W, 13] than theirs."""
        w = self.windows
        states = self._states(space, points, first, w.sample[index], w.samples, finer)
        return np.nan_to_num(states[:, :, w.steps])

    def _states(
        self,
        space: ContactSpace,
        points: np.ndarray,
        first: np.ndarray,
        sample: np.ndarray,
        samples: int,
        finer: int,
    ) -> np.ndarray:
        """So many states [C, W, samples, 13] from first ones [W, 13] at these samples [W] of their episodes."""
        return simulate(
            space.machines(points),
            self.track.shape,
            first,
            samples,
            self.track.sample_time,
            starts=sample * self.track.sample_time,
            substeps=self.substeps * finer,
            terms=space.terms,
            threads=1,
        )

    def whitened(self, space: ContactSpace, point: np.ndarray) -> "Predictor":
        """The same with residuals in units of what is not known, at this point."""
        index = np.arange(len(self.windows.first))
        covariance = self.covariance(space, point, index)
        inside = np.repeat(self.windows.inside, 6, axis=1)
        whiten = np.linalg.inv(np.linalg.cholesky(covariance)) * inside[:, :, None] * inside[:, None, :]
        return Predictor(self.track, self.windows, self.stretches, whiten, self._sieve(space, point))

    def _sieve(self, space: ContactSpace, point: np.ndarray) -> np.ndarray:
        """What of the polynomials of stretches counts, in units of what is not known [S, 6·ORDERS, 6·ORDERS]."""
        of = self.stretches
        index = np.arange(len(of.first))
        if not len(index):
            return self.sieve

        def changed(first: np.ndarray, finer: int = 1) -> np.ndarray:
            return np.asarray(plainly - self.seen(space, point[None], index, first, finer)[0])

        def moved(by: np.ndarray) -> np.ndarray:
            return changed(_displaced(of.first, by * np.repeat(of.sigma, 3, axis=1)))

        plainly = self.seen(space, point[None], index, of.first)[0]
        linear = _to_first_order(moved, len(index))
        rest = _beyond(moved, linear, DRAWS // 2)
        step = changed(of.first, FINER)[..., None]
        spread = np.concatenate([ANYTHING * linear, rest, step], axis=2)
        bias = np.repeat(np.divide(self.track.bias, self.track.states.noise), 3) ** 2
        slow = np.tile(bias, ORDERS) * of.count[:, None] / ORDERS  # what of a pose is off changes as the body turns
        covariance = spread @ spread.transpose(0, 2, 1) + np.eye(slow.shape[1]) * (1 + slow[:, None])
        variance, ways = np.linalg.eigh(covariance)
        counts = variance < BLIND * (1 + slow.max(axis=1, keepdims=True))
        return np.asarray((ways / np.sqrt(variance[:, None]) * counts[:, None]).transpose(0, 2, 1))

    def covariance(self, space: ContactSpace, point: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Of the differences [W, 6·H, 6·H] that a right machine leaves."""
        w, track = self.windows, self.track
        plain = self.run(space, point[None], index, w.first[index], 1)[0]

        def moved(by: np.ndarray) -> np.ndarray:
            """What moving the first states by [W, 12] of their standard deviations changes [W, 6·H]."""
            first = _displaced(w.first[index], by * np.repeat(w.sigma[index], 3, axis=1))
            states = self.run(space, point[None], index, first, 1)[0]
            return difference(states, plain).reshape(len(index), -1)

        level = 2 if space.terms.place is None else 0  # the support is as good elsewhere, and what is on it only moves
        aside = np.eye(6)[:, :level] * w.sigma[index, 0][:, None, None]
        aside = np.tile(aside, (1, len(w.steps), 1))
        linear = np.concatenate([aside, _to_first_order(moved, len(index), level)], axis=2)  # [W, 6·H, 12]
        rest = _beyond(moved, linear, DRAWS)
        fine = self.run(space, point[None], index, w.first[index], FINER)[0]
        step = difference(fine, plain).reshape(len(index), -1, 1)
        spread = np.concatenate([linear, rest, step], axis=2)
        noise = np.tile(np.repeat(np.square(track.states.noise) + np.square(track.bias), 3), len(w.steps))
        out = spread @ spread.transpose(0, 2, 1) + np.diag(noise)
        inside = np.repeat(w.inside[index], 6, axis=1)
        # Beyond an episode's end a variance of its own, so that the rest can be whitened.
        return np.where(inside[:, :, None] & inside[:, None, :], out, np.eye(out.shape[1]))


_Moved = Callable[[np.ndarray], np.ndarray]  # by [W, 12] standard deviations of first states to what it changes [W, P]


def _to_first_order(moved: _Moved, count: int, since: int = 0) -> np.ndarray:
    """What each of the axes from `since` on changes [W, P, 12 - since] of so many starts."""
    axes = np.broadcast_to(np.eye(12)[since:, None], (12 - since, count, 12))
    return np.stack([(moved(axis) - moved(-axis)) / 2 for axis in axes], axis=2)


def _beyond(moved: _Moved, linear: np.ndarray, count: int) -> np.ndarray:
    """What so many draws change beyond what is `linear` [W, P, 12], a share [W, P, count] of its variance each.

    Where the outcome hangs on a hair, on which corner touches first, it is of all axes together, and not linear.
    """
    draws = np.random.default_rng(0).standard_normal((count, len(linear), 12))
    return np.stack([moved(by) - np.einsum("wpa,wa->wp", linear, by) for by in draws], axis=2) / np.sqrt(count)


def _displaced(first: np.ndarray, by: np.ndarray) -> np.ndarray:
    """States [W, 13] moved along the twelve axes of position, attitude, velocity and spin, by [W, 12]."""
    out = first.copy()
    out[:, :3] += by[:, :3]
    out[:, 3:7] = (Rotation.from_rotvec(by[:, 3:6]) * Rotation.from_quat(first[:, 3:7])).as_quat()
    out[:, 7:] += by[:, 6:]
    return out


def plain(track: ContactTrack, windows: Windows, stretches: Stretches | None = None) -> Predictor:
    """A predictor of the stretches and of what windows lie in none, which tell all that the others would.

    Residuals are in units of the poses' noise alone, and nothing of its stretches is looked at.
    """
    stretches = none_of(track) if stretches is None else stretches
    windows = outside(windows, stretches)
    size = 6 * len(windows.steps)
    sigma = np.tile(np.repeat(np.hypot(track.states.noise, track.bias), 3), len(windows.steps))
    inside = np.repeat(windows.inside, 6, axis=1)
    whiten = np.broadcast_to(np.diag(1 / sigma), (len(windows.first), size, size)) * inside[:, :, None]
    return Predictor(track, windows, stretches, whiten, np.zeros((len(stretches.first), 6 * ORDERS, 6 * ORDERS)))
