"""What hypotheses predict of each frame, and how far that is off."""

import math
import threading
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vision_s2r.appearance import label_of
from vision_s2r.fit.camera import discrepancy
from vision_s2r.fit.camera.area import inside_of
from vision_s2r.fit.camera.codec import behind
from vision_s2r.fit.camera.effect import at_stage
from vision_s2r.fit.camera.grain import OF_ROWS, TOLD, Varied, per_share
from vision_s2r.fit.camera.light import STEADY, stops
from vision_s2r.fit.camera.mixing import of_frame_before
from vision_s2r.fit.camera.prediction import without_encoder
from vision_s2r.fit.camera.rounding import rendered_colours, unrounded
from vision_s2r.fit.camera.scoring import FrameScore, predicted_noise, score
from vision_s2r.fit.camera.study import Study
from vision_s2r.fit.case import Hypothesis, Segments, Values

_REMEMBERED = 12  # hypotheses whose scores are kept
_REMEMBERED_VALUES = 12_000_000  # in pictures whose predictions are kept, three numbers a value


class CameraPredictor:
    """Predictions of a recording's frames: each is made once, while it is asked for again and again."""

    def __init__(self, study: Study) -> None:
        self._study = study
        self._scores: dict[tuple[object, ...], list[FrameScore]] = {}
        self._predictions: dict[tuple[object, ...], tuple[Tensor, Tensor, Tensor]] = {}
        self._told: dict[tuple[object, ...], bool] = {}
        self._lock = threading.Lock()
        self._rendered = rendered_colours(study.pictures)

    def mean(self, values: Values, segments: list[int]) -> tuple[Tensor, Tensor | None]:
        """Before the encoder: the mean, and the variance of noise effects."""
        prediction = self._study.pictures.predict(without_encoder(values), segments)
        return prediction.mean, prediction.variance

    def frames(self, values: Values, segments: Sequence[int], lit: bool) -> tuple[Tensor, Tensor, Tensor]:
        """The mean before the encoder, in each frame's own light where `lit`; variance of noise; weights of pixels.

        Unknowns are fitted beside the same values again and again: frames are predicted once.
        """
        lit = lit and self._study.pictures.light != STEADY
        frames = [self._remembered(values, segment, lit) for segment in segments]
        mean, noise, weight = (torch.cat(each) for each in zip(*frames, strict=True))
        return mean, noise, weight

    def _remembered(self, values: Values, segment: int, lit: bool) -> tuple[Tensor, Tensor, Tensor]:
        key = (*key_of(Hypothesis(values)), segment, lit)
        with self._lock:
            found = self._predictions.pop(key, None)
        found = found or self._predicted_frame(values, segment, lit)
        with self._lock:
            self._predictions[key] = found  # the last that was asked for
            if len(self._predictions) > _REMEMBERED_VALUES // found[0].numel():
                self._predictions.pop(next(iter(self._predictions)))
        return found

    def _predicted_frame(self, values: Values, segment: int, lit: bool) -> tuple[Tensor, Tensor, Tensor]:
        mean, variance = self.mean(values, [segment])
        yardstick, pictures = self._study.yardstick, self._study.pictures
        noise = predicted_noise(yardstick, variance, mean, [segment])
        weight = yardstick.counted[[segment]] / (noise + yardstick.tolerance[[segment]])
        if lit:
            mean = pictures.light.on(mean, pictures.real[[segment]], weight, pictures.encoding).mean
        return mean, noise, weight

    def before(self, values: Values, segments: Sequence[int], unknown: Collection[str], lit: bool) -> Tensor | None:
        """The mean of the frames before these, where an unknown asks for it; of the first that of itself."""
        if "mixing" not in unknown:
            return None
        return self.frames(values, [max(segment - 1, 0) for segment in segments], lit)[0]

    def encoded(self, mean: Tensor, values: Values) -> Tensor:
        """The mean behind the encoder."""
        return behind(self._study.pictures, mean, values, self._study.yardstick.noise.base)

    @torch.inference_mode()
    def residual(self, hypothesis: Hypothesis, segments: Segments, lit: bool) -> tuple[Tensor, Tensor, float]:
        """Real less predicted [B, C, H, W], the noise variance predicted, and the share of outliers.

        `lit`: each frame in its own light, as fits see it; else in the simulator's, as a replay has it.
        """
        segments = list(segments)
        mean, noise, weight = self.frames(hypothesis.values, segments, lit)
        real = self._study.pictures.real[segments]
        residual = real - self.encoded(mean, hypothesis.values)
        added, before = torch.zeros_like(mean), self.before(hypothesis.values, segments, hypothesis.extra, lit)
        for name in sorted(hypothesis.extra):
            added = added + discrepancy.add(name, hypothesis.extra[name], mean, residual - added, weight, before)
        share = float(hypothesis.extra["outliers"].coefficients[0]) if "outliers" in hypothesis.extra else 0.0
        if hypothesis.extra:
            residual = real - self.encoded((mean + added).clamp(0, 1), hypothesis.values)
        return residual, noise, share

    def told(self, hypothesis: Hypothesis, kinds: Collection[str]) -> bool:
        """Whether what is left is not random, as a noise or a grain is: the frame before tells it, or such an unknown.

        It takes seconds to ask, and labels ask the same.
        """
        key = (*key_of(hypothesis), *sorted(kinds))
        if key not in self._told:
            self._told[key] = self._is_told(hypothesis, kinds)
        return self._told[key]

    @torch.inference_mode()
    def _is_told(self, hypothesis: Hypothesis, kinds: Collection[str]) -> bool:
        every, counted = range(self._study.count), self._study.yardstick.counted
        mean, left = self.frames(hypothesis.values, every, lit=True)[0], self.residual(hypothesis, every, lit=True)[0]
        if of_frame_before(left, mean, counted) > TOLD:
            return True
        some = self._study.asked
        told = discrepancy.told_by(kinds, left[some], mean[some], counted[some].float())
        return any(share > (OF_ROWS if name == "row_noise" else TOLD) for name, share in told.items())

    def scored(self, hypothesis: Hypothesis, segments: Segments, lit: bool = True) -> list[FrameScore]:
        lit = lit and self._study.pictures.light != STEADY
        key = (*key_of(hypothesis), tuple(segments), lit)
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
        yardstick = self._study.yardstick
        unpredicted, varied = self.unpredicted(hypothesis.values), self._varied(hypothesis.values, segment)
        beside = outliers, bool(hypothesis.extra), varied, unpredicted
        if not self._rendered:
            return score(yardstick, residual, noise, [segment], *beside)
        counted = yardstick.counted[[segment]]
        if unpredicted is not None:
            counted = counted & ~unpredicted
        left = unrounded(residual, self._rendered[segment], counted)
        return score(yardstick, left, noise, [segment], *beside, whole=residual)

    def unpredicted(self, values: Values) -> Tensor | None:
        """Where [H, W] (bool) nothing is predicted, as something else is there."""
        areas = at_stage(values, "area")
        if not areas:
            return None
        pictures = self._study.pictures
        inside = [inside_of(values[name], pictures.sim.shape[-2:], pictures.scale) for name in areas]
        return torch.stack(inside).any(0)

    def _varied(self, values: Values, segment: int) -> list[Varied]:
        """What the grain of each label makes of a frame."""
        names, surfaces = at_stage(values, "grain"), self._study.pictures.surfaces
        if not names or surfaces is None:
            return []
        mean, _, _ = self.frames(values, [segment], lit=True)
        share, scene = per_share(mean, self._study.pictures.encoding), surfaces.of([segment])
        found = []
        for name in names:
            amplitude, scale = values[name]["amplitude"], values[name]["scale"]
            region = scene.region(label_of(name) or 0)
            found.append(Varied((amplitude * region * share).square(), math.pi * scale**2))
        return found

    @torch.inference_mode()
    def light(self, hypothesis: Hypothesis) -> dict[str, Any] | None:
        """The exposure (EV) of each frame against the simulator's under a hypothesis; None where light is steady."""
        pictures, exposures = self._study.pictures, []
        if pictures.light == STEADY:
            return None
        for segment in range(self._study.count):
            mean, _, weight = self.frames(hypothesis.values, [segment], lit=False)
            lit = pictures.light.on(mean, pictures.real[[segment]], weight, pictures.encoding)
            exposures += stops(lit, pictures.encoding).tolist()
        spread = float(np.std(exposures, ddof=1))
        return {"differs_in": pictures.light.kind, "exposure": exposures, "spread": spread, "unit": "EV"}


def key_of(hypothesis: Hypothesis) -> tuple[object, ...]:
    """What tells a hypothesis from others."""
    values = tuple((name, *value.values()) for name, value in hypothesis.values.items())
    extra = tuple((name, fitted.coefficients.tobytes(), fitted.ghost) for name, fitted in hypothesis.extra.items())
    return values, extra
