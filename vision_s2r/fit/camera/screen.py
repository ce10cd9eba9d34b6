"""What each name would gain beside a hypothesis, before it is fitted."""

from collections.abc import Callable, Collection, Mapping, Sequence

import numpy as np
import torch

from vision_s2r.effects import Effect
from vision_s2r.fit.camera.coordinates import starts
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, charted, of_stage
from vision_s2r.fit.camera.fitter import CameraFitter
from vision_s2r.fit.camera.fitting import Beside, columns
from vision_s2r.fit.camera.prediction import Stages, without_encoder
from vision_s2r.fit.camera.predictor import CameraPredictor, key_of
from vision_s2r.fit.camera.study import Study
from vision_s2r.fit.case import Hypothesis, Segments, Values


class CameraScreen:
    """Gains of names beside hypotheses, each worked out once."""

    def __init__(
        self,
        study: Study,
        predictor: CameraPredictor,
        fitter: CameraFitter,
        library: Mapping[str, Effect],
        discrepancies: Collection[str],
    ) -> None:
        self._study, self._predictor, self._fitter = study, predictor, fitter
        self._library, self._discrepancies = library, frozenset(discrepancies)
        self._gains: dict[tuple[object, str], float] = {}

    @torch.inference_mode()
    def gains(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each name would gain: one linear step from the best of a few settings."""
        few, key = self._fitter.few(range(self._study.count))[:2], key_of(hypothesis)
        linear = self._linear(hypothesis, few)
        for name in names:
            if (key, name) not in self._gains:
                self._gains[key, name] = self._gain(hypothesis, name, few, linear)
        return {name: self._gains[key, name] for name in names}

    def _linear(self, hypothesis: Hypothesis, few: list[int]) -> Callable[[str], float]:
        """What an effect that moves pictures gains on these frames, nats, beside the slopes of those that there are."""
        target, values = self._fitter.target, hypothesis.values
        stages: Stages = {}
        residual, lit = target.compare(values, few, stages, keep=True)
        if hypothesis.extra:  # effects get what the unknown leaves
            residual = self._predictor.residual(hypothesis, few, lit=True)[0]
        slopes, _ = columns(target, values, charted(values), few, stages, lit)
        plain = without_encoder(values)
        base = target.pictures.predict(plain, few, stages).mean
        beside = Beside.of(target, slopes, residual, few)

        def gain(name: str, setting: Mapping[str, float]) -> float:
            change = (target.pictures.predict(plain | {name: setting}, few, stages).mean - base)[None]
            return beside.gain((change if lit is None else lit.beside(change))[0], self._library[name].one_sided)

        return lambda name: max(gain(name, setting) for setting in self._settings(name))

    def _gain(self, hypothesis: Hypothesis, name: str, few: list[int], linear: Callable[[str], float]) -> float:
        if name in self._discrepancies:
            return self._unknown_gain(hypothesis, name)
        if name in of_stage("noise"):
            return self._noise_gain(hypothesis, name)
        if name == "jpeg_compression":
            return 0.0
        if CAMERA_FITS[name].stage in APART:
            return self._gain_apart(hypothesis, name, few)
        counted = self._fitter.target.counted
        pixels = float(counted.sum()) / max(float(counted[few].sum()), 1)
        return linear(name) * pixels / self._study.yardstick.temper

    def _unknown_gain(self, hypothesis: Hypothesis, name: str) -> float:
        """Of an unknown, which is fitted to all frames and asked of some."""
        names, values = sorted({*hypothesis.extra, name}), hypothesis.values
        fitted = Hypothesis(values, self._fitter.fit_unknown(values, names, range(self._study.count)))
        some = range(0, self._study.count, 4)
        return (self._loglik(fitted, some) - self._loglik(hypothesis, some)) * self._study.count / len(some)

    def _gain_apart(self, hypothesis: Hypothesis, name: str, few: list[int]) -> float:
        values = dict(hypothesis.values) | self._fitter.fit_apart(hypothesis.values, [name], few)
        if self._library[name].is_neutral(values[name]):
            return 0.0
        gain = self._loglik(Hypothesis(values), few) - self._loglik(hypothesis, few)
        return max(gain, 0.0) * self._study.count / len(few)

    def _loglik(self, hypothesis: Hypothesis, segments: Segments) -> float:
        return sum(float(each.loglik.sum()) for each in self._predictor.scored(hypothesis, segments))

    def _settings(self, name: str) -> list[Mapping[str, float]]:
        """A few settings of an effect; that of the reference first, where it has one."""
        options = starts(name, self._fitter.target.pictures.optics)
        if name not in self._study.reference:
            return [*options]
        return [self._study.reference[name], *options[:: max(len(options) // 4, 1)]]

    def _noise_gain(self, hypothesis: Hypothesis, name: str) -> float:
        noise, bins = self._study.yardstick.noise, self._study.bins
        segments = range(self._study.count)
        variance, counts = bins.variance(segments)
        usable = np.isfinite(variance)
        names = [*[each for each in hypothesis.values if each in of_stage("noise")], name]
        fitted = self._fitter.fit_noise(hypothesis.values, names, segments)

        def loglik(values: Values) -> float:
            model = noise.at(values, bins.values)[usable]
            return float((-0.5 * counts[usable] * (np.log(model) + variance[usable] / model)).sum())

        return (
            max(loglik(dict(hypothesis.values) | fitted) - loglik(hypothesis.values), 0.0)
            / self._study.yardstick.temper
        )
