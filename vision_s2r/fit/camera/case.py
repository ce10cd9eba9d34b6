"""A paired recording of a camera as a case of the diagnosis."""

import math
import threading
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import torch
from scipy.special import stdtrit
from torch import Tensor

from vision_s2r.appearance import label_of
from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.effects import Effect, Parameter, unqualified
from vision_s2r.fit.camera import axes, discrepancy, excitation
from vision_s2r.fit.camera.area import area_of, inside_of, seen_behind
from vision_s2r.fit.camera.consistency import (
    ALLOWED,
    BY_CHANNEL,
    COLOURS,
    DIRECTION,
    EVERY,
    GEOMETRIC,
    PARITY,
    disagreement,
)
from vision_s2r.fit.camera.coordinates import at_scale, bounded, neutral, starts
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, at_stage, charted, of_stage
from vision_s2r.fit.camera.finer import with_finer_warps
from vision_s2r.fit.camera.fitting import (
    Beside,
    Target,
    best_start,
    columns,
    gauss_newton,
    search_factor,
)
from vision_s2r.fit.camera.grain import REMEMBERED, Varied, grain_of, of_frame_before, per_share
from vision_s2r.fit.camera.intervals import Spread, spread
from vision_s2r.fit.camera.light import STEADY, UNSTEADY, stops
from vision_s2r.fit.camera.noise import Tail
from vision_s2r.fit.camera.prediction import Stages, without_encoder
from vision_s2r.fit.camera.reference import fitted_variance
from vision_s2r.fit.camera.rounding import rendered_colours, unrounded
from vision_s2r.fit.camera.scoring import FrameScore, mismatch, predicted_noise, score
from vision_s2r.fit.camera.study import Study, frames_of_a_fit, open_pictures, study
from vision_s2r.fit.camera.surfaces import library_of
from vision_s2r.fit.case import Experiment, Hypothesis, Names, Samples, Segments, Values, confusable
from vision_s2r.recording import CameraRecording
from vision_s2r.threads import one_thread

_DISCREPANCY_VALUES = 1_000_000  # that the fit of a discrepancy looks at, at most
_NEGLIGIBLE = 0.01  # mean squared change, in units of the noise, that nobody could see
_ROUNDED = 1.5  # times the variance of rounding, likewise
_SHOWING = 500  # samples of a brightness, that tell how noisy it is
_GRAIN = 0.03  # of a grain's strength and length, that its form leaves open
_EDGE = 2.0  # px, to which the edge of an area is seen, where it may look like what is behind
_STEP, _BESIDE_REST = 1 / 255, 0.3  # coded change beside surfaces that differ; of what is left: less is nothing
_SPREAD = 0.3  # relative difference of a parameter between frames that a true effect does not have
_ASKED = 16  # frames, the most telling, whose parts are asked for the size of an effect
_REMEMBERED = 12  # hypotheses whose scores are kept
_REMEMBERED_VALUES = 12_000_000  # in pictures whose predictions are kept, three numbers a value


class CameraCase:
    """Pairs of pictures beside the camera's effects.

    The gap is that of coded values, pixel by pixel, in grey levels (of 255): the root mean square of what is real less
    what is predicted. Where the amount of noise differs, the squared difference of its standard deviations counts too.
    """

    kind = "camera"
    sharp = True
    replaced: Mapping[str, float] = {}
    rough: Names = frozenset()
    guessed: Names = frozenset()
    motions: int = 1
    refitted: Names = frozenset()
    metric = "pixel_rmse"
    unit = "grey levels"
    described = (
        "coded pixel values of frames that no fit has seen, real against predicted; a difference in the amount of "
        "noise counts by the difference of its standard deviations"
    )

    @classmethod
    def open(cls, recording: CameraRecording, library: Mapping[str, Effect]) -> "CameraCase":
        """Look at a recording for its noise and for effects to ask about: seconds."""
        library = library_of(recording, library)
        with one_thread():
            return cls(recording, library, study(recording, library))

    def __init__(self, recording: CameraRecording, library: Mapping[str, Effect], study: Study) -> None:
        self.recording = recording
        self.library = library
        self.segments = len(recording)
        self.discrepancies = discrepancy.available(recording.grey)
        self.study = study
        self.certain: Mapping[str, float] = {"jpeg_compression": self.study.jpeg[1]} if self.study.jpeg else {}
        self.unsteady = "" if self.study.pictures.light == STEADY else UNSTEADY
        self.not_excited: Mapping[str, str] = self.study.not_excited
        self.allowance = self.study.yardstick.allowance
        pictures, yardstick = study.pictures, study.yardstick
        counted = yardstick.counted
        if study.area is not None:
            counted = counted & ~inside_of(study.area, counted.shape[-2:])
        self._target = Target(pictures, fitted_variance(pictures, yardstick.variance), counted)
        self._fits: dict[tuple[Names, tuple[int, ...]], Hypothesis] = {}
        self._scores: dict[tuple[object, ...], list[FrameScore]] = {}
        self._predictions: dict[tuple[object, ...], tuple[Tensor, Tensor, Tensor]] = {}
        self._gains: dict[tuple[object, str], float] = {}
        self._noises: dict[tuple[object, ...], dict[str, dict[str, float]]] = {}
        self._spreads: dict[tuple[object, ...], Spread] = {}
        self._frames = frames_of_a_fit(self.study.pictures)
        self._lock = threading.Lock()
        self._rendered = rendered_colours(self.study.pictures)

    def session(self) -> AbstractContextManager[None]:
        """To be held while methods are called: pictures are so small that torch is best kept to one thread."""
        return one_thread()

    # -- fitting

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's own unit."""
        return parameter.unit

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and discrepancies on these segments; `start` is near, or None."""
        key = (names, tuple(segments))
        if key not in self._fits:
            self._fits[key] = self._fit(names, tuple(segments), start)
        return self._fits[key]

    @torch.inference_mode()
    def _fit(self, names: Names, segments: tuple[int, ...], start: Hypothesis | None) -> Hypothesis:
        plain = frozenset(names & self.library.keys())
        apart = at_stage(sorted(plain), *APART)
        plain -= frozenset(apart)
        unknown = sorted(names & self.discrepancies.keys())
        # An unknown is fitted to what the effects leave, which are the same whatever stands beside them.
        beside = unknown or apart
        values = self.fit(plain, segments, start).values if beside else self._fit_effects(plain, segments, start)
        values = dict(values) | self._fit_apart(values, apart, segments)
        return Hypothesis(values, self._fit_discrepancies(values, unknown, list(segments)))

    def _fit_effects(
        self, names: Names, segments: tuple[int, ...], start: Hypothesis | None
    ) -> dict[str, dict[str, float]]:
        effects = sorted(names)
        few = self._few(segments)
        values = self._begin(frozenset(effects), start, few)
        noisy = [name for name in effects if name in of_stage("noise")]
        moving = charted(effects)
        if noisy:
            values |= self._fit_noise(values, noisy, segments)
        whole = len(segments) == self.segments
        found = gauss_newton(self._target, values, moving, few, 6 if whole else 3)[0]
        if "low_resolution" in names:
            found = search_factor(self._target, found, few)[0]
            found = gauss_newton(self._target, found, moving, few, 2)[0]
        if noisy and moving:
            found = {**found, **self._fit_noise(found, noisy, segments)}
        return {name: dict(found[name]) for name in effects}

    def _fit_noise(self, values: Values, names: Sequence[str], segments: Sequence[int]) -> dict[str, dict[str, float]]:
        """The noise of `names`, for which only the tone of `values` matters: most hypotheses have the same."""
        tone = {name: value for name, value in values.items() if name in of_stage("tone")}
        tail = Tail.of(tone, self.study.pictures.encoding, self.study.pictures.sim.shape[1])
        key = (tail, tuple(names), tuple(segments))
        if key not in self._noises:
            self._noises[key] = self.study.yardstick.noise.fit(tone, names, self.study.bins, segments)
        return {name: dict(value) for name, value in self._noises[key].items()}

    def _fit_apart(self, values: Values, names: Sequence[str], segments: Sequence[int]) -> dict[str, dict[str, float]]:
        """The grain of labels, and the area of a missing object, in what effects leave; of no size if there is none."""
        found: dict[str, dict[str, float]] = {}
        surfaces = self.study.pictures.surfaces
        if not names or surfaces is None:
            return found
        mean, _, _ = self._predicted(values, segments, lit=True)
        residual = self.study.pictures.real[list(segments)] - self._encoded(mean, values)
        for name in names:
            if CAMERA_FITS[name].stage == "area":
                found[name] = self._fit_area(name, residual, segments)
                continue
            region, counted = surfaces.of(segments).region(label_of(name) or 0), self._target.counted[list(segments)]
            grain = grain_of(residual, mean, region, counted, self.study.pictures.encoding)
            found[name] = {"amplitude": 0.0, "scale": 6.0} if grain is None else bounded(name, asdict(grain))
        return found

    def _fit_area(self, name: str, residual: Tensor, segments: Sequence[int]) -> dict[str, float]:
        yardstick, surfaces = self.study.yardstick, self.study.pictures.surfaces
        chosen = list(segments)
        squared = (residual.square() / yardstick.variance[chosen]).mean(1)
        assert surfaces is not None
        area = area_of(squared, yardstick.counted[chosen], surfaces.shares[chosen])
        if area is None:
            return neutral(name, self.study.pictures.optics)
        return at_scale(name, area, 1 / self.study.pictures.scale)

    def _unpredicted(self, values: Values) -> Tensor | None:
        """Where [H, W] (bool) nothing is predicted, as something else is there."""
        areas = at_stage(values, "area")
        if not areas:
            return None
        pictures = self.study.pictures
        inside = [inside_of(values[name], pictures.sim.shape[-2:], pictures.scale) for name in areas]
        return torch.stack(inside).any(0)

    def _varied(self, values: Values, segment: int) -> list[Varied]:
        """What the grain of each label makes of a frame."""
        names, surfaces = at_stage(values, "grain"), self.study.pictures.surfaces
        if not names or surfaces is None:
            return []
        mean, _, _ = self._predicted(values, [segment], lit=True)
        share, scene = per_share(mean, self.study.pictures.encoding), surfaces.of([segment])
        found = []
        for name in names:
            amplitude, scale = values[name]["amplitude"], values[name]["scale"]
            region = scene.region(label_of(name) or 0)
            found.append(Varied((amplitude * region * share).square(), math.pi * scale**2))
        return found

    def _few(self, segments: Sequence[int]) -> list[int]:
        """The frames that show most, of these."""
        return sorted([segment for segment in self.study.ranked if segment in set(segments)][: self._frames])

    def _begin(self, names: Names, start: Hypothesis | None, few: list[int]) -> dict[str, dict[str, float]]:
        """Values of all of `names` from which a fit of them should end well."""
        noises = of_stage("noise")
        moving = names - noises
        values: dict[str, dict[str, float]] = {}
        known = dict(start.values) if start is not None and names <= start.values.keys() else self.study.known(moving)
        if known is None:
            known = dict(start.values) if start is not None else {}
        for name in sorted(names):
            if name in known:
                values[name] = dict(known[name])
            elif name == "jpeg_compression":
                values[name] = {"quality": float(self.study.jpeg[0] if self.study.jpeg else 90)}
            elif name in noises:
                values[name] = dict(starts(name, self.study.pictures.optics)[0])
        for name in sorted(moving - values.keys()):
            options = starts(name, self.study.pictures.optics)
            if name in self.study.reference:
                options = [dict(self.study.reference[name]), *options]
            values = {
                each: dict(value) for each, value in best_start(self._target, values, name, few[:2], options).items()
            }
        return values

    def _fit_discrepancies(
        self, values: Values, names: list[str], segments: list[int]
    ) -> dict[str, discrepancy.FittedDiscrepancy]:
        fitted: dict[str, discrepancy.FittedDiscrepancy] = {}
        if not names:
            return fitted
        segments = segments[: max(_DISCREPANCY_VALUES // self.study.pictures.sim[0].numel(), 2)]
        mean, _, weight = self._predicted(values, segments, lit=True)
        residual = self.study.pictures.real[segments] - self._encoded(mean, values)
        added = torch.zeros_like(mean)
        for name in names:
            fitted[name] = discrepancy.fit(name, residual - added, mean, weight)
            added = added + discrepancy.add(name, fitted[name], mean, residual - added, weight)
        return fitted

    # -- predicting

    def _mean(self, values: Values, segments: list[int]) -> tuple[Tensor, Tensor | None]:
        """Before the encoder: the mean, and the variance of noise effects."""
        prediction = self.study.pictures.predict(without_encoder(values), segments)
        return prediction.mean, prediction.variance

    def _predicted(self, values: Values, segments: Sequence[int], lit: bool) -> tuple[Tensor, Tensor, Tensor]:
        """The mean before the encoder, in each frame's own light where `lit`; variance of noise; weights of pixels.

        Unknowns are fitted beside the same values again and again: frames are predicted once.
        """
        lit = lit and self.study.pictures.light != STEADY
        frames = [self._remembered(values, segment, lit) for segment in segments]
        mean, noise, weight = (torch.cat(each) for each in zip(*frames, strict=True))
        return mean, noise, weight

    def _remembered(self, values: Values, segment: int, lit: bool) -> tuple[Tensor, Tensor, Tensor]:
        key = (*_key(Hypothesis(values)), segment, lit)
        with self._lock:
            found = self._predictions.pop(key, None)
        found = found or self._predicted_frame(values, segment, lit)
        with self._lock:
            self._predictions[key] = found  # the last that was asked for
            if len(self._predictions) > _REMEMBERED_VALUES // found[0].numel():
                self._predictions.pop(next(iter(self._predictions)))
        return found

    def _predicted_frame(self, values: Values, segment: int, lit: bool) -> tuple[Tensor, Tensor, Tensor]:
        mean, variance = self._mean(values, [segment])
        yardstick, pictures = self.study.yardstick, self.study.pictures
        noise = predicted_noise(yardstick, variance, mean)
        weight = yardstick.counted[[segment]] / (noise + yardstick.tolerance[[segment]])
        if lit:
            mean = pictures.light.on(mean, pictures.real[[segment]], weight).mean
        return mean, noise, weight

    def _encoded(self, mean: Tensor, values: Values) -> Tensor:
        return self.study.pictures.through_encoder(mean, values)

    @torch.inference_mode()
    def residual(self, hypothesis: Hypothesis, segments: Segments, lit: bool) -> tuple[Tensor, Tensor, float]:
        """Real less predicted [B, C, H, W], the noise variance predicted, and the share of outliers.

        `lit`: each frame in its own light, as fits see it; else in the simulator's, as a replay has it.
        """
        segments = list(segments)
        mean, noise, weight = self._predicted(hypothesis.values, segments, lit)
        real = self.study.pictures.real[segments]
        residual = real - self._encoded(mean, hypothesis.values)
        added = torch.zeros_like(mean)
        for name in sorted(hypothesis.extra):
            added = added + discrepancy.add(name, hypothesis.extra[name], mean, residual - added, weight)
        share = float(hypothesis.extra["outliers"].coefficients[0]) if "outliers" in hypothesis.extra else 0.0
        if hypothesis.extra:
            residual = real - self._encoded((mean + added).clamp(0, 1), hypothesis.values)
        return residual, noise, share

    def _scored(self, hypothesis: Hypothesis, segments: Segments, lit: bool = True) -> list[FrameScore]:
        lit = lit and self.study.pictures.light != STEADY
        key = (*_key(hypothesis), tuple(segments), lit)
        if key not in self._scores:
            scores: list[FrameScore] = []
            for segment in segments:  # a frame at a time stays in the cache
                residual, noise, outliers = self.residual(hypothesis, [segment], lit)
                scores += self._score(residual, noise, segment, outliers, hypothesis)
            with self._lock:
                if len(self._scores) >= _REMEMBERED:
                    self._scores.pop(next(iter(self._scores)))
                self._scores[key] = scores
            return scores
        return self._scores[key]

    def _score(
        self,
        residual: Tensor,
        noise: Tensor,
        segment: int,
        outliers: float,
        hypothesis: Hypothesis,
    ) -> list[FrameScore]:
        """A frame's score, about what the renderer's rounding leaves; the gap is that of its pictures as they are."""
        yardstick = self.study.yardstick
        unpredicted, varied = self._unpredicted(hypothesis.values), self._varied(hypothesis.values, segment)
        beside = outliers, bool(hypothesis.extra), varied, unpredicted
        if not self._rendered:
            return score(yardstick, residual, noise, [segment], *beside)
        counted = yardstick.counted[[segment]]
        if unpredicted is not None:
            counted = counted & ~unpredicted
        left = unrounded(residual, self._rendered[segment], counted)
        return score(yardstick, left, noise, [segment], *beside, whole=residual)

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        """Of each frame, the log-likelihood [blocks] (nats) of the sixteen parts that it is divided into."""
        return [each.loglik for each in self._scored(hypothesis, segments)]

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared residual [segments] in units of the noise that the recording was measured to have."""
        return np.array([each.excess for each in self._scored(hypothesis, segments)])

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared error [segments], grey levels squared, in the simulator's own light."""
        return np.array([each.error for each in self._scored(hypothesis, segments, lit=False)])

    def floor(self, segments: Segments) -> np.ndarray:
        """Noise variance [segments], grey levels squared."""
        counted = self.study.yardstick.counted[list(segments)].float()
        noise = (self.study.yardstick.floor[list(segments)] * counted).sum((1, 2, 3))
        pixels = counted.sum((1, 2, 3)).clamp(min=1) * self.study.yardstick.measured.shape[1]
        return (noise / pixels / self.study.yardstick.scale**2 * 255**2).double().numpy()

    @torch.inference_mode()
    def samples(self, hypothesis: Hypothesis) -> Samples:
        """Every second pixel, and every cosine coefficient of 8 px blocks."""
        segments = list(range(self.segments))
        residual, noise, _ = self.residual(hypothesis, segments, lit=False)
        yardstick = self.study.yardstick
        shrunk = yardstick.scale**2
        fine = mismatch(yardstick, noise, segments) / shrunk + yardstick.measured * (1 / shrunk - 1)
        every = round(1 / self.study.pictures.scale)
        labels = self.recording.labels
        error, floor = residual.square() + fine, yardstick.floor / shrunk
        unpredicted = self._unpredicted(hypothesis.values)
        if unpredicted is not None:
            error, residual = torch.where(unpredicted, floor, error), residual.masked_fill(unpredicted, 0.0)
        return axes.samples(
            error * 255**2,
            floor * 255**2,
            residual * 255,
            self.study.pictures.real,
            yardstick.counted,
            None if labels is None else labels[:, ::every, ::every][:, : residual.shape[-2], : residual.shape[-1]],
        )

    @torch.inference_mode()
    def light(self, hypothesis: Hypothesis) -> dict[str, Any] | None:
        """The exposure (EV) of each frame against the simulator's under a hypothesis; None where light is steady."""
        pictures, exposures = self.study.pictures, []
        if pictures.light == STEADY:
            return None
        for segment in range(self.segments):
            mean, _, weight = self._predicted(hypothesis.values, [segment], lit=False)
            exposures += stops(pictures.light.on(mean, pictures.real[[segment]], weight), pictures.encoding).tolist()
        spread = float(np.std(exposures, ddof=1))
        return {"differs_in": pictures.light.kind, "exposure": exposures, "spread": spread, "unit": "EV"}

    # -- what to ask

    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """None: no effect has axes of its own."""
        return None

    @torch.inference_mode()
    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each name would gain: one linear step from the best of a few settings."""
        few = self._few(range(self.segments))[:2]
        target, values = self._target, hypothesis.values
        stages: Stages = {}
        residual, lit = target.compare(values, few, stages, keep=True)
        if hypothesis.extra:  # effects get what the unknown leaves
            residual = self.residual(hypothesis, few, lit=True)[0]
        slopes, _ = columns(target, values, charted(values), few, stages, lit)
        plain = without_encoder(values)
        base = target.pictures.predict(plain, few, stages).mean
        pixels = float(target.counted.sum()) / max(float(target.counted[few].sum()), 1)

        beside = Beside.of(target, slopes, residual, few)

        def gain(name: str, setting: Mapping[str, float]) -> float:
            moved = target.pictures.predict(plain | {name: setting}, few, stages).mean
            change = (moved - base)[None]
            one_sided = self.library[name].one_sided
            return beside.gain((change if lit is None else lit.beside(change))[0], one_sided)

        gains: dict[str, float] = {}
        for name in names:
            if (place := (_key(hypothesis), name)) in self._gains:
                gains[name] = self._gains[place]
                continue
            if name in self.discrepancies:
                gains[name] = self._unknown_gain(hypothesis, name)
            elif name in of_stage("noise"):
                gains[name] = self._noise_gain(hypothesis, name)
            elif name == "jpeg_compression":
                gains[name] = 0.0
            elif CAMERA_FITS[name].stage in APART:
                gains[name] = self._gain_apart(hypothesis, name, few)
            else:
                best = max(gain(name, setting) for setting in self._settings(name))
                gains[name] = best * pixels / self.study.yardstick.temper
            self._gains[place] = gains[name]
        return gains

    def _unknown_gain(self, hypothesis: Hypothesis, name: str) -> float:
        """Of an unknown, which is fitted to all frames and asked of some."""
        names = hypothesis.values.keys() | hypothesis.extra.keys()
        fitted, some = self.fit(frozenset({*names, name}), range(self.segments), hypothesis), range(0, self.segments, 4)
        both = [sum(float(each.loglik.sum()) for each in self._scored(of, some)) for of in (fitted, hypothesis)]
        return (both[0] - both[1]) * self.segments / len(some)

    def _gain_apart(self, hypothesis: Hypothesis, name: str, few: list[int]) -> float:
        values = dict(hypothesis.values) | self._fit_apart(hypothesis.values, [name], few)
        if self.library[name].is_neutral(values[name]):
            return 0.0
        both = [
            sum(float(each.loglik.sum()) for each in self._scored(of, few)) for of in (Hypothesis(values), hypothesis)
        ]
        return max(both[0] - both[1], 0.0) * self.segments / len(few)

    def _settings(self, name: str) -> list[Mapping[str, float]]:
        """A few settings of an effect; that of the reference first, where it has one."""
        options = starts(name, self._target.pictures.optics)
        if name not in self.study.reference:
            return [*options]
        return [self.study.reference[name], *options[:: max(len(options) // 4, 1)]]

    def _noise_gain(self, hypothesis: Hypothesis, name: str) -> float:
        noise, bins = self.study.yardstick.noise, self.study.bins
        segments = range(self.segments)
        variance, counts = bins.variance(segments)
        usable = np.isfinite(variance)
        names = [*[each for each in hypothesis.values if each in of_stage("noise")], name]
        fitted = self._fit_noise(hypothesis.values, names, segments)

        def loglik(values: Values) -> float:
            model = noise.at(values, bins.values)[usable]
            return float((-0.5 * counts[usable] * (np.log(model) + variance[usable] / model)).sum())

        return (
            max(loglik(dict(hypothesis.values) | fitted) - loglik(hypothesis.values), 0.0) / self.study.yardstick.temper
        )

    def proposals(self) -> Sequence[Names]:
        """Sets that a fit of everything, thinned out, suggests."""
        return self.study.proposals

    def simplify(self, names: Names) -> Sequence[Names]:
        """None: what says the same with fewer effects is among the proposals."""
        return []

    def confusable(self, name: str) -> Names:
        """Effects hard to tell from this one."""
        return confusable(unqualified(name), CAMERA_FITS.items())

    # -- what to believe

    @torch.inference_mode()
    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether switching the effect off changes nothing that could be seen above the simulator's tolerance."""
        few = self._few(range(self.segments))
        values = hypothesis.values
        if name in self.certain:
            return False
        if CAMERA_FITS[name].stage in APART:
            return bool(self.library[name].is_neutral(values[name]))
        if excitation.faint(name, values, self.study.pictures.scale) or self._within_a_lens(name, values):
            return True
        without = {each: value for each, value in values.items() if each != name}
        if name in of_stage("noise"):
            return self._unseen_noise(values, without)
        (mean, variance), (other, other_variance) = self._mean(values, few), self._mean(without, few)
        yardstick = self.study.yardstick
        if name == "jpeg_compression":
            other, mean = mean, self._encoded(mean, values)
        spread_change = (
            predicted_noise(yardstick, variance, mean).sqrt() - predicted_noise(yardstick, other_variance, mean).sqrt()
        )
        if at_stage(values, "scene") and CAMERA_FITS[name].stage in ("scene", "light", "tone"):
            # Colours are rendered to a step, and which way surfaces face is known to a degree.
            left = self.residual(hypothesis, few, lit=True)[0]
            least = max(
                _STEP, _BESIDE_REST * float(left[yardstick.counted[few].expand_as(left)].square().mean().sqrt())
            )
            if float((mean - other).square().mean().sqrt()) < least:
                return True
        counted = yardstick.counted[few].expand_as(mean)
        if not counted.any():
            return True
        change = ((mean - other).square() + spread_change.square())[counted]
        # A blur makes of a rounded slope what it was: the simulator's own rounding is no effect.
        rounding = (self.study.pictures.scale / (2**self.recording.bits - 1)) ** 2 / 12
        seen = float((change / yardstick.variance[few].expand_as(mean)[counted]).mean())
        return seen < _NEGLIGIBLE or float(change.mean()) < _ROUNDED * rounding

    def _within_a_lens(self, name: str, values: Values) -> bool:
        """Whether a warp moves things less than another one may move them otherwise than its definition."""
        fit = CAMERA_FITS[name]
        if fit.stage != "warp" or fit.by_channel:
            return False
        others = [each for each in at_stage(values, "warp") if each != name]
        allowed = sum(CAMERA_FITS[each].otherwise * self._moved(each, values) for each in others)
        return self._moved(name, values) < allowed

    def _moved(self, name: str, values: Values) -> float:
        """How far a warp moves things, px (root mean square over the picture)."""
        pictures, own = self.study.pictures, at_scale(name, values[name], self.study.pictures.scale)
        moved = pictures.looked(CAMERA_EFFECTS[name], own) - pictures.places(1)
        return float(moved.square().sum(0).mean().sqrt())

    def _unseen_noise(self, values: Values, without: Values) -> bool:
        """Whether no brightness shows what differs in noise: read noise shows in the dark, and may nowhere else."""
        noise, bins = self.study.yardstick.noise, self.study.bins
        variance, counts = bins.variance(range(self.segments))
        usable = np.isfinite(variance) & (counts > _SHOWING)
        spread, other = (np.sqrt(noise.at(each, bins.values)[usable]) for each in (values, without))
        return not usable.any() or float(((spread / other - 1) ** 2).max()) < _NEGLIGIBLE

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect sits at a bound, or differs between frames or parts of them more than a camera's does."""
        values = hypothesis.values[name]
        for parameter in self.library[name].parameters:
            if parameter.neutral is None or name == "jpeg_compression":
                continue
            if (
                values[parameter.name] in (parameter.low, parameter.high)
                and values[parameter.name] != parameter.neutral
            ):
                return True
        stage = CAMERA_FITS[name].stage
        if stage in APART:
            return self._mixed(hypothesis.values) if stage == "grain" else self._shows_behind(hypothesis.values, name)
        if stage == "noise" and "levels" in hypothesis.extra:  # what steps leave looks as random
            return bool(hypothesis.extra["levels"].coefficients.size)
        found = self._disagreements(hypothesis.values, name)
        # What scales light scales the edges that a warp or a blur moves.
        axes = EVERY if stage in ("light", "tone") else GEOMETRIC
        if _differs(found, axes) or _between_channels(name, found):
            return True
        if not charted([name]):
            return False
        return self._spread(hypothesis).relative.get(name, 0.0) > _SPREAD

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether rows, columns or channels ask for another size of it, even where no more than noise is left.

        Or edges that run another way, of what moves or blurs them.
        """
        stage = CAMERA_FITS[name].stage
        if stage in APART:
            return self._mixed(hypothesis.values) if stage == "grain" else self._shows_behind(hypothesis.values, name)
        found = self._disagreements(hypothesis.values, name)
        axes = (*PARITY, DIRECTION) if stage in ("warp", "blur") else PARITY
        return _differs(found, axes) or _between_channels(name, found)

    @torch.inference_mode()
    def _mixed(self, values: Values) -> bool:
        """Whether what is left shows the frame before, and so is no grain."""
        pictures, yardstick = self.study.pictures, self.study.yardstick
        mean = self._predicted(values, range(self.segments), lit=True)[0]
        left = pictures.real - self._encoded(mean, values)
        return of_frame_before(left, mean, yardstick.counted) > REMEMBERED

    @torch.inference_mode()
    def _shows_behind(self, values: Values, name: str) -> bool:
        """Whether what was rendered shows in an area that something else is said to fill: then it is light upon it."""
        pictures = self.study.pictures
        mean = self._predicted(values, range(self.segments), lit=True)[0]
        inside = inside_of(values[name], pictures.sim.shape[-2:], pictures.scale)
        return seen_behind(pictures.real, mean, self.study.yardstick.counted & inside)

    @torch.inference_mode()
    def _disagreements(self, values: Values, name: str) -> dict[str, float]:
        """By axis, how much more of the effect some pixels ask for than others; none of noise."""
        if CAMERA_FITS[name].stage not in ("warp", "blur", "light", "tone"):
            return {}
        asked = sorted(self.study.ranked[:_ASKED])
        mean, _, weight = self._predicted(values, asked, lit=True)
        without = {each: value for each, value in values.items() if each != name}
        other = self._predicted(without, asked, lit=True)[0]
        left = self.study.pictures.real[asked] - self._encoded(mean, values)
        return disagreement(mean - other, left, weight, other)

    def intervals(self, hypothesis: Hypothesis) -> dict[str, dict[str, tuple[float, float]]]:
        """95 % of every parameter, from how frames differ."""
        return self._spread(hypothesis).intervals | self._intervals_apart(hypothesis)

    def _intervals_apart(self, hypothesis: Hypothesis) -> dict[str, dict[str, tuple[float, float]]]:
        """By leaving out groups of frames in turn (jackknife)."""
        names, groups = at_stage(hypothesis.values, *APART), min(4, self.segments)
        rest = [[k for k in range(self.segments) if k % groups != group] for group in range(groups)]
        left = [self._fit_apart(hypothesis.values, names, some) for some in rest]
        found: dict[str, dict[str, tuple[float, float]]] = {}
        for name in names:
            for key, value in hypothesis.values[name].items():
                each = np.array([one[name][key] for one in left])
                deviation = np.sqrt((groups - 1) / groups * np.sum((each - each.mean()) ** 2))
                least = _GRAIN * value
                if CAMERA_FITS[name].stage == "area":
                    least = _EDGE / self.study.pictures.scale + _blurred(hypothesis.values)
                half = max(stdtrit(groups - 1, 0.975) * float(deviation), least)
                found.setdefault(name, {})[key] = (value - half, value + half)
        return found

    def _spread(self, hypothesis: Hypothesis) -> Spread:
        key = _key(hypothesis)
        if key not in self._spreads:
            with torch.inference_mode():
                self._spreads[key] = spread(self._target, self.study, hypothesis.values)
        return self._spreads[key]

    @torch.inference_mode()
    def finer(self, hypothesis: Hypothesis) -> Hypothesis:
        """Its warps fitted once more on finer pictures, where those that were worked on are small."""
        pictures = self.study.pictures
        if pictures.scale == 1:
            return hypothesis
        return replace(hypothesis, values=with_finer_warps(open_pictures(self.recording), pictures, hypothesis.values))

    def experiment(self, rivals: Sequence[Hypothesis], not_excited: Sequence[str]) -> Experiment:
        """What to photograph next."""
        from vision_s2r.fit.camera.experiment import advise

        return advise(self.study, rivals, {name: self.not_excited[name] for name in not_excited})


def _differs(found: Mapping[str, float], axes: Sequence[str]) -> bool:
    """Whether an effect is of another size along one of these axes."""
    return max((found[axis] for axis in axes if axis in found), default=0.0) > ALLOWED


def _between_channels(name: str, found: Mapping[str, float]) -> bool:
    """Whether channels, or their sites on a sensor, ask for other sizes of what moves or blurs all of them alike."""
    fit = CAMERA_FITS[name]
    most = max((found[axis] for axis in COLOURS if axis in found), default=0.0)
    return fit.stage in ("warp", "blur") and not fit.by_channel and most > BY_CHANNEL


def _blurred(values: Values) -> float:
    """How far (px) blurs take an edge."""
    blurs = [(key, value) for name in at_stage(values, "blur") for key, value in values[name].items()]
    return sum(value / 2 if key == "length" else value for key, value in blurs if key in ("radius", "length"))


def _key(hypothesis: Hypothesis) -> tuple[object, ...]:
    values = tuple((name, *value.values()) for name, value in hypothesis.values.items())
    extra = tuple((name, fitted.coefficients.tobytes(), fitted.ghost) for name, fitted in hypothesis.extra.items())
    return values, extra
