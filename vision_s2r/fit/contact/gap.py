"""The gap of a contact: positions in windows of a tenth of a second, each from a measured state.

In longer ones a few of those in which a hair decides between two outcomes are most of the sum of squares.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.fit.case import Axis, Hypothesis, Samples
from vision_s2r.fit.contact.fitter import ContactFitter, names_of
from vision_s2r.fit.contact.phases import phases_of
from vision_s2r.fit.contact.predictor import Predictor, plain
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.contact.windows import Windows, windows_of

WINDOW = 0.1  # s
REPLICAS, SEED = 4, 0  # of first states, drawn as uncertain as they are


class ContactGap:
    """Squared errors of the position, window by window."""

    def __init__(self, fitter: ContactFitter, windows: Windows, best: Hypothesis) -> None:
        self._fitter, rows, track = fitter, fitter.predictor, fitter.predictor.track
        self._short, self._long = plain(track, windows), plain(track, windows_of(track, WINDOW, WINDOW, thin=False))
        self._floor = self._make_floor(best)
        self._phases, self._phases_of_rows = (
            phases_of(track, each.episode, each.sample, each.samples) for each in (self._short, rows)
        )

    def of(self, hypothesis: Hypothesis, segments: Iterable[int]) -> np.ndarray:
        """Mean squared error [segments], m²."""
        return self._means(self._squared(self._long, hypothesis), segments)

    def floor(self, segments: Iterable[int]) -> np.ndarray:
        """What a perfect simulator would leave: poses are measured with noise, and so is each first state."""
        return self._means(self._floor, segments)

    def samples(self, hypothesis: Hypothesis) -> Samples:
        """Squared errors in the short windows of the search, by what the body does in them."""
        short = self._short
        inside = short.windows.inside
        error = self._squared(short, hypothesis)[inside]
        floor = np.broadcast_to(self._short_floor[:, None], inside.shape)[inside]
        episode = np.broadcast_to(short.windows.episode[:, None], inside.shape)[inside]
        axes = tuple(
            Axis(axis.name, axis.labels, np.broadcast_to(axis.bins[:, None], inside.shape)[inside])
            for axis in self._phases
        )
        return Samples(error=error, floor=floor, segment=episode, axes=axes)

    def moved(self, squares: np.ndarray, along: Sequence[str]) -> Samples:
        """What an effect changes of each row, its squares [R, 6·ORDERS], by these axes; there is no noise in it."""
        change = squares.sum(axis=1)
        axes = tuple(axis for axis in self._phases_of_rows if axis.name in along)
        return Samples(error=change, floor=np.zeros(len(change)), segment=self._fitter.predictor.episode, axes=axes)

    def _squared(self, predictor: Predictor, hypothesis: Hypothesis) -> np.ndarray:
        """[W, H] m²."""
        space = self._fitter.space(names_of(hypothesis))
        index = np.arange(len(predictor.windows.first))
        raw = predictor.differences(space, space.start(hypothesis)[None], index)[0]
        return np.asarray((raw[..., :3] ** 2).sum(axis=-1))

    def _make_floor(self, best: Hypothesis) -> np.ndarray:
        space = self._fitter.space(names_of(best))
        point = space.start(best)
        self._short_floor = self._perturbed(self._short, space, point).mean(axis=1)
        return self._perturbed(self._long, space, point)

    def _perturbed(self, predictor: Predictor, space: ContactSpace, point: np.ndarray) -> np.ndarray:
        """Mean squared change [W, H] of predictions when first states are as uncertain as they are; and noise."""
        rng, track, w = np.random.default_rng(SEED), predictor.track, predictor.windows
        index = np.arange(len(w.first))
        truth = predictor.run(space, point[None], index, w.first)[0]
        total = np.zeros(w.inside.shape)
        for _ in range(REPLICAS):
            first = w.first.copy()
            draw = rng.normal(size=(len(first), 12)) * np.repeat(w.sigma, 3, axis=1)
            first[:, :3] += draw[:, :3]
            first[:, 3:7] = (Rotation.from_rotvec(draw[:, 3:6]) * Rotation.from_quat(first[:, 3:7])).as_quat()
            first[:, 7:] += draw[:, 6:]
            other = predictor.run(space, point[None], index, first)[0]
            total += ((other - truth)[..., :3] ** 2).sum(axis=-1)
        return np.asarray(total / REPLICAS + 3 * (track.states.noise[0] ** 2 + track.bias[0] ** 2))

    def _means(self, values: np.ndarray, segments: Iterable[int]) -> np.ndarray:
        w = self._long.windows
        out = []
        for segment in segments:
            of = values[w.episode == segment][w.inside[w.episode == segment]]
            out.append(float(of.mean()) if len(of) else 0.0)
        return np.array(out)
