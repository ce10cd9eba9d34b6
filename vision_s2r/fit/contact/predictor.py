"""What machines predict of windows, set against what was measured, in units of what is not known of it.

Not known are the measured poses (their noise, and how far bodies at rest are off), the first state, which every
prediction carries on (to first order: its covariance through the simulator; and what draws of it leave of that), and
what the simulator's step leaves. All poses of a window are whitened together.
"""

import math
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.contact import simulate
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.contact.windows import ContactTrack, Windows, difference

STEP = 0.0025  # s, of the integrator in touch, at most
FINER = 4  # times the steps, for the integrator's own error
DRAWS = 24  # of first states
REMEMBERED = 400  # machines whose residuals are kept

_Known = OrderedDict[bytes, tuple[np.ndarray, np.ndarray]]  # residuals [W, 6·H], and of which windows [W] they are


@dataclass(frozen=True)
class Predictor:
    """Runs points of spaces over windows of a track."""

    track: ContactTrack
    windows: Windows
    whiten: np.ndarray  # [W, 6·H, 6·H] lower triangles, of residuals by horizon; beyond an episode's end 0
    # By machine, the last asked for last.
    _known: _Known = field(default_factory=OrderedDict, repr=False, compare=False)

    channels = 1  # of the residuals

    @property
    def substeps(self) -> int:
        """Steps a sample."""
        return max(1, math.ceil(self.track.sample_time / STEP - 1e-9))

    def residuals(self, space: ContactSpace, points: np.ndarray, windows: Sequence[int]) -> np.ndarray:
        """Whitened residuals [C, W, 6·H, 1] of points [C, D]; of a machine that is asked for again, as they were."""
        index, terms = np.asarray(windows), space.terms.array().tobytes()
        rows = space.machines(points)
        found = [self._of(space, point, row.tobytes() + terms, index) for point, row in zip(points, rows, strict=True)]
        return np.stack(found)[..., None]

    def _of(self, space: ContactSpace, point: np.ndarray, machine: bytes, index: np.ndarray) -> np.ndarray:
        """Whitened residuals [W, 6·H] of one machine, run in those windows in which it has not been."""
        count, size = self.whiten.shape[:2]
        kept, done = self._known.pop(machine, (np.zeros((count, size)), np.zeros(count, dtype=bool)))
        missing = index[~done[index]]
        if len(missing):
            raw = self.differences(space, point[None], missing)[0].reshape(len(missing), -1)
            kept, done = kept.copy(), done.copy()  # another thread may be reading
            kept[missing], done[missing] = np.einsum("wij,wj->wi", self.whiten[missing], raw), True
        self._known[machine] = kept, done
        while len(self._known) > REMEMBERED:
            self._known.popitem(last=False)
        return kept[index]

    def differences(self, space: ContactSpace, points: np.ndarray, index: np.ndarray, finer: int = 1) -> np.ndarray:
        """Measured less predicted poses [C, W, H, 6]."""
        states = self.run(space, points, index, self.windows.first[index], finer)
        return difference(self.windows.measured[index], states)

    def slopes(self, space: ContactSpace, point: np.ndarray, windows: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Residuals [W, 6·H, 1] of a point [D], and their change with each coordinate [D, W, 6·H, 1]."""
        points, steps = space.differences(point)
        residuals = self.residuals(space, points, windows)
        return residuals[0], (residuals[1:] - residuals[0]) / steps[:, None, None, None]

    def run(
        self, space: ContactSpace, points: np.ndarray, index: np.ndarray, first: np.ndarray, finer: int = 1
    ) -> np.ndarray:
        """States [C, W, H, 13] at the horizons of windows, from other first states [W, 13] than theirs."""
        w = self.windows
        starts = w.sample[index] * self.track.sample_time
        states = simulate(
            space.machines(points),
            self.track.shape,
            first,
            w.samples,
            self.track.sample_time,
            starts=starts,
            substeps=self.substeps * finer,
            terms=space.terms,
            threads=1,
        )
        return np.nan_to_num(states[:, :, w.steps])

    def whitened(self, space: ContactSpace, point: np.ndarray) -> "Predictor":
        """The same with residuals in units of what is not known, at this point."""
        index = np.arange(len(self.windows.first))
        covariance = self.covariance(space, point, index)
        inside = np.repeat(self.windows.inside, 6, axis=1)
        whiten = np.linalg.inv(np.linalg.cholesky(covariance))
        return Predictor(self.track, self.windows, whiten * inside[:, :, None] * inside[:, None, :])

    def covariance(self, space: ContactSpace, point: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Of the differences [W, 6·H, 6·H] that a right machine leaves."""
        w, track = self.windows, self.track
        plain = self.run(space, point[None], index, w.first[index], 1)[0]

        def moved(by: np.ndarray) -> np.ndarray:
            """What moving the first states by [W, 12] of their standard deviations changes [W, 6·H]."""
            first = w.first[index]
            for axis in range(12):
                first = _moved(first, axis, by[:, axis] * w.sigma[index, axis // 3])
            states = self.run(space, point[None], index, first, 1)[0]
            return difference(states, plain).reshape(len(index), -1)

        axes = np.broadcast_to(np.eye(12)[:, None], (12, len(index), 12))
        level = 2 if space.terms.place is None else 0  # the support is as good elsewhere, and what is on it only moves
        linear = np.stack([(moved(axis) - moved(-axis)) / 2 for axis in axes[level:]], axis=2)  # [W, 6·H, 12 - level]
        aside = np.eye(6)[:, :level] * w.sigma[index, 0][:, None, None]
        linear = np.concatenate([np.tile(aside, (1, len(w.steps), 1)), linear], axis=2)  # [W, 6·H, 12]
        # Where the outcome hangs on a hair, on which corner touches first, it is of all axes together, and not linear.
        rng = np.random.default_rng(0)
        draws = rng.standard_normal((DRAWS, len(index), 12))
        rest = np.stack([moved(by) - np.einsum("wpa,wa->wp", linear, by) for by in draws], axis=2) / np.sqrt(DRAWS)
        fine = self.run(space, point[None], index, w.first[index], FINER)[0]
        step = difference(fine, plain).reshape(len(index), -1, 1)
        spread = np.concatenate([linear, rest, step], axis=2)
        noise = np.tile(np.repeat(np.square(track.states.noise) + np.square(track.bias), 3), len(w.steps))
        out = spread @ spread.transpose(0, 2, 1) + np.diag(noise)
        inside = np.repeat(w.inside[index], 6, axis=1)
        # Beyond an episode's end a variance of its own, so that the rest can be whitened.
        return np.where(inside[:, :, None] & inside[:, None, :], out, np.eye(out.shape[1]))


def _moved(first: np.ndarray, axis: int, by: np.ndarray) -> np.ndarray:
    """States [W, 13] moved along one of the twelve axes of position, attitude, velocity and spin."""
    out = first.copy()
    if axis < 3:
        out[:, axis] += by
    elif axis < 6:
        turn = np.zeros((len(first), 3))
        turn[:, axis - 3] = by
        out[:, 3:7] = (Rotation.from_rotvec(turn) * Rotation.from_quat(first[:, 3:7])).as_quat()
    else:
        out[:, axis + 1] += by
    return out


def plain(track: ContactTrack, windows: Windows) -> Predictor:
    """A predictor whose residuals are in units of the poses' noise alone."""
    size = 6 * len(windows.steps)
    sigma = np.tile(np.repeat(np.hypot(track.states.noise, track.bias), 3), len(windows.steps))
    inside = np.repeat(windows.inside, 6, axis=1)
    whiten = np.broadcast_to(np.diag(1 / sigma), (len(windows.first), size, size)) * inside[:, :, None]
    return Predictor(track, windows, whiten)
