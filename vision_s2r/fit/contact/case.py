"""Tosses of a body as a case of the diagnosis."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import cached_property

import numpy as np

from vision_s2r.contact import COEFFICIENTS
from vision_s2r.effects import Effect, Parameter
from vision_s2r.fit.case import NOMINAL, Experiment, Hypothesis, Intervals, Names, Samples, Segments, confusable
from vision_s2r.fit.contact import steadiness, uncertainty
from vision_s2r.fit.contact.discrepancy import MEANINGS, terms_of
from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactScales
from vision_s2r.fit.contact.experiments import experiment
from vision_s2r.fit.contact.fitter import ContactFitter, names_of
from vision_s2r.fit.contact.gap import ContactGap
from vision_s2r.fit.contact.optima import beside_unknowns, optima
from vision_s2r.fit.contact.predictor import plain
from vision_s2r.fit.contact.stretches import stretches_of
from vision_s2r.fit.contact.windows import SPAN, STRIDE, make_track, windows_of
from vision_s2r.fit.likelihood import log_density
from vision_s2r.fit.selection import SCALE
from vision_s2r.recording import ContactRecording

WINSOR = 16.0  # squared residuals beyond, in units of the noise, count as this: an impact that came out differently
LAYERS = 3  # effects that are taken off, at most, before what is not known is read off what is left
CLEAR = 30.0  # nats that an effect seems to gain for that
DETECTABLE = 20.0  # nats that an effect of plausible size should bring
TOLERANCE = 0.01  # relative change of a nominal coefficient that is the simulator's own …
SLIGHT = 0.003  # … or this much, absolute
INCONSTANT = 0.5  # relative spread over episodes that a true effect's steadiest parameter does not have …
APART, DIFFERENT = 5.0, 0.3  # … nor differs between two halves of the windows: standard errors, and relative


class ContactCase:
    """Episodes of a body on its support beside the simulator of `vision_s2r.contact`.

    The search looks at poses in windows of 0.1 s, each from a measured state, and so does the gap, at positions. An
    episode is a segment.
    """

    kind = "contact"
    sharp = False
    replaced: Mapping[str, float] = {}
    refitted: Names = frozenset()  # a wrong coefficient is an effect as any other
    unsteady = ""
    allowance = 0.0
    rough: Names = frozenset({name for name, fit in CONTACT_FITS.items() if fit.rough})
    guessed: Names = frozenset()
    measured: Mapping[str, float] = {}
    motions: int = 1
    discrepancies: Mapping[str, str] = MEANINGS
    certain: Mapping[str, float] = {}
    metric, unit = "position_rmse", "m"
    described = "position in windows of 0.1 s that each begin at a measured state, of tosses that no fit has seen"

    def __init__(self, recording: ContactRecording, library: Mapping[str, Effect]) -> None:
        self.recording, self.library = recording, library
        self.segments = len(recording)
        self.track = make_track(recording)
        self._windows, self._stretches = windows_of(self.track), stretches_of(self.track)
        self._scales = ContactScales(self.track.nominal, self.track.shape, self.track.sample_time)
        self._terms = terms_of(self.track)
        self._elsewhere: dict[str, Intervals] = {}  # by hypothesis
        self._prepare()

    def _prepare(self) -> None:
        """What is not known of predictions depends on the machine: that of the likeliest few effects."""
        episodes = range(self.segments)
        overlap = min(1.0, 1.5 * STRIDE / SPAN)
        nominal = self._fitter_of(NOMINAL, overlap)
        both = frozenset(COEFFICIENTS) & frozenset(self.library)
        best = first = nominal.fit(both, episodes, NOMINAL)
        fitter = self._fitter_of(best, overlap)
        for _ in range(LAYERS):
            gains = fitter.gains(best, sorted(self.library.keys() - names_of(best)))
            name = max(gains, key=lambda each: gains[each], default=None)
            if name is None or gains[name] < CLEAR:
                break
            best = fitter.fit(names_of(best) | {name}, episodes, best)
        self._fitter = fitter if best is first else self._fitter_of(best, overlap)
        self._best = best = self._fitter.fit(names_of(best), episodes, best)
        self._gap = ContactGap(self._fitter, self._windows, best)
        gains = self._fitter.gains(NOMINAL, sorted(self.library))
        idle = [name for name, gain in gains.items() if gain < DETECTABLE]
        self.not_excited: Mapping[str, str] = {
            name: CONTACT_FITS[name].not_excited for name in idle if self._fitter.shows(best, name) < DETECTABLE
        }

    def _fitter_of(self, hypothesis: Hypothesis, temper: float) -> ContactFitter:
        predictor = plain(self.track, self._windows, self._stretches)
        return ContactFitter.under(hypothesis, predictor, self._scales, self._terms, temper)

    @cached_property
    def _piecewise(self) -> ContactFitter:
        """By short windows everywhere: what differs within a stretch shows between them."""
        predictor, temper = plain(self.track, self._windows), float(self._fitter.temper[0])
        return ContactFitter.under(self._best, predictor, self._scales, self._terms, temper)

    def session(self) -> AbstractContextManager[None]:
        """Nothing is held."""
        return nullcontext()

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's unit."""
        return parameter.unit

    # -- fits and scores

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and terms on these episodes; `start` is near, or None."""
        return self._fitter.fit(names, list(segments), start)

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        """Log-likelihood [windows] (nats) of each episode, tempered by how far windows overlap."""
        residuals = self._fitter.residuals(hypothesis, segments)
        scale = np.asarray(hypothesis.extra.get(SCALE, self._fitter.floor))
        density = log_density(residuals[..., None], np.maximum(scale, self._fitter.floor))[..., 0]
        each = (density * self._fitter.predictor.inside).sum(axis=1) * float(self._fitter.temper[0])
        return [each[self._fitter.predictor.episode == segment] for segment in segments]

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared residual [segments] in units of what is not known, single poses limited."""
        squares = np.minimum(self._fitter.residuals(hypothesis, segments) ** 2, WINSOR)
        inside, episode = self._fitter.predictor.inside, self._fitter.predictor.episode
        of = [(squares[rows], inside[rows]) for rows in (episode == s for s in segments)]
        return np.array([float(square[within].mean()) if within.any() else 1.0 for square, within in of])

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared error [segments] of positions in windows of 0.1 s, m²."""
        return self._gap.of(hypothesis, segments)

    def floor(self, segments: Segments) -> np.ndarray:
        """That of a perfect simulator: the noise of poses, and of the states that windows begin at."""
        return self._gap.floor(segments)

    def samples(self, hypothesis: Hypothesis) -> Samples:
        """The squared errors of short windows, pose by pose."""
        return self._gap.samples(hypothesis)

    # -- what to try

    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """What an effect does to each row, squared and in units of what is not known, along its own axes."""
        along = CONTACT_FITS[name].along
        return self._gap.moved(self._change(hypothesis, name), along) if along else None

    def _change(self, hypothesis: Hypothesis, name: str) -> np.ndarray:
        """Squares [R, 6·ORDERS] of what an effect of the hypothesis changes, in units of what is not known, limited."""
        both = (hypothesis, hypothesis.without(name))
        one, other = (self._fitter.residuals(each, range(self.segments)) for each in both)
        return np.minimum((one - other) ** 2, WINSOR)

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each of these names would gain."""
        return self._fitter.gains(hypothesis, list(names))

    def proposals(self) -> Sequence[Names]:
        """None: every effect is tried."""
        return []

    def simplify(self, names: Names) -> Sequence[Names]:
        """None: no two effects are one with others."""
        return []

    def confusable(self, name: str) -> Names:
        """Effects that may pass for this one."""
        return confusable(name, CONTACT_FITS.items())

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect changes less than the simulator's own error does."""
        values = hypothesis.values.get(name)
        if values is None:
            return False
        if name in COEFFICIENTS:
            nominal = float(getattr(self.track.nominal, name))
            return abs(values["value"] - nominal) < max(TOLERANCE * nominal, SLIGHT)
        return bool(self._change(hypothesis, name).mean() < 1e-3)

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether parameters are at a bound, or differ between episodes as a stand-in's do."""
        if name not in hypothesis.values:
            return False
        if uncertainty.at_bound(self._fitter, hypothesis, name):
            return True
        if any(steadiness.spread(each, hypothesis, name) > INCONSTANT for each in (self._fitter, self._piecewise)):
            return True
        return self.contradicted(hypothesis, name)

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether two halves of the windows ask for plainly different parameters."""
        if name in self.rough:
            return False
        contrasts = (steadiness.contrast(each, hypothesis, name) for each in (self._fitter, self._piecewise))
        return any(errors > APART and relative > DIFFERENT for errors, relative in contrasts)

    def wavers(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: tosses are too short to tell."""
        return False

    def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: tosses are as unlike as recordings of them."""
        return False

    def intervals(self, hypothesis: Hypothesis) -> Intervals:
        """95 % of every parameter."""
        return uncertainty.intervals(self._fitter, hypothesis) if hypothesis.values else {}

    def intervals_elsewhere(self, hypothesis: Hypothesis) -> Intervals:
        """Of every parameter, from the least to the most that it may as well be, as other tosses would say."""
        key = repr(hypothesis)
        if key not in self._elsewhere:
            ends = [self.intervals(each) for each in optima(self._fitter, hypothesis, self._nats)]
            ends += [_points(each) for each in beside_unknowns(self._fitter, hypothesis, self._nats)]
            self._elsewhere[key] = {
                name: {p: _hull([own, *(end[name][p] for end in ends)]) for p, own in parameters.items()}
                for name, parameters in self.intervals(hypothesis).items()
            }
        return self._elsewhere[key]

    def _nats(self, hypothesis: Hypothesis) -> np.ndarray:
        """Log-likelihood [segments] (nats) of each episode."""
        return np.array([each.sum() for each in self.loglik(hypothesis, range(self.segments))])

    def experiment(self, rivals: Sequence[Hypothesis], not_excited: Sequence[str]) -> Experiment:
        """The recording to make next."""
        others = sorted(self.library.keys() - rivals[0].values.keys()) if rivals else []
        return experiment(self.track, rivals, not_excited, others, float(self._fitter.temper[0]))


def _points(hypothesis: Hypothesis) -> Intervals:
    """Values as intervals of no length."""
    return {name: {p: (value, value) for p, value in values.items()} for name, values in hypothesis.values.items()}


def _hull(intervals: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """The shortest interval around all of these."""
    return min(low for low, _ in intervals), max(high for _, high in intervals)
