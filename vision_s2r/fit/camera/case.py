"""A paired recording of a camera as a case of the diagnosis."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vision_s2r.effects import Effect, Parameter, unqualified
from vision_s2r.fit.camera import axes, discrepancy
from vision_s2r.fit.camera.common_light import CommonLight
from vision_s2r.fit.camera.coordinates import at_bound
from vision_s2r.fit.camera.doubts import CameraDoubts
from vision_s2r.fit.camera.effect import CAMERA_FITS
from vision_s2r.fit.camera.finer import with_finer_warps
from vision_s2r.fit.camera.fitter import CameraFitter
from vision_s2r.fit.camera.light import STEADY, UNSTEADY
from vision_s2r.fit.camera.predictor import CameraPredictor
from vision_s2r.fit.camera.scoring import mismatch
from vision_s2r.fit.camera.screen import CameraScreen
from vision_s2r.fit.camera.study import Study, open_pictures, study
from vision_s2r.fit.camera.surfaces import library_of
from vision_s2r.fit.camera.uncertainty import CameraUncertainty
from vision_s2r.fit.case import Experiment, Hypothesis, Intervals, Names, Samples, Segments, confusable
from vision_s2r.recording import CameraRecording
from vision_s2r.threads import one_thread

_NOISY = 0.05  # of what there is over the floor, that a noise has to be


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
        self.measured: Mapping[str, float] = self.study.photon_transfer
        self.unsteady = "" if self.study.pictures.light == STEADY else UNSTEADY
        self.not_excited: Mapping[str, str] = self.study.not_excited
        self.allowance = self.study.yardstick.allowance
        self._predictor = predictor = CameraPredictor(study)
        self._fitter = fitter = CameraFitter(study, predictor, library, self.discrepancies)
        self._screen = CameraScreen(study, predictor, fitter, library, self.discrepancies)
        self._common = common = CommonLight(study, fitter.target)
        self._uncertainty = CameraUncertainty(study, fitter, common)
        self._doubts = CameraDoubts(study, predictor, fitter, self._uncertainty, library, self.certain, recording.bits)

    def session(self) -> AbstractContextManager[None]:
        """To be held while methods are called: pictures are so small that torch is best kept to one thread."""
        return one_thread()

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's own unit."""
        return parameter.unit

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and discrepancies on these segments; `start` is near, or None."""
        return self._fitter.fit(names, segments, start)

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        """Of each frame, the log-likelihood [blocks] (nats) of the sixteen parts that it is divided into."""
        return [each.loglik for each in self._predictor.scored(hypothesis, segments)]

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared residual [segments] in units of the noise that the recording was measured to have."""
        return np.array([each.excess for each in self._predictor.scored(hypothesis, segments)])

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean squared error [segments], grey levels squared, in the simulator's own light."""
        return np.array([each.error for each in self._predictor.scored(hypothesis, segments, lit=False)])

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
        residual, noise, _ = self._predictor.residual(hypothesis, segments, lit=False)
        yardstick = self.study.yardstick
        shrunk = yardstick.scale**2
        fine = mismatch(yardstick, noise, segments) / shrunk + yardstick.measured * (1 / shrunk - 1)
        error, floor = residual.square() + fine, yardstick.floor / shrunk
        unpredicted = self._predictor.unpredicted(hypothesis.values)
        if unpredicted is not None:
            error, residual = torch.where(unpredicted, floor, error), residual.masked_fill(unpredicted, 0.0)
        return self._by_place(error, floor, residual)

    @torch.inference_mode()
    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """What an effect changes of means and of noise, along the axes of its definition."""
        along = CAMERA_FITS[unqualified(name)].along
        if not along:
            return None
        (one, noise, _), (other, quiet, _) = (
            self._predictor.residual(each, range(self.segments), lit=False)
            for each in (hypothesis, hypothesis.without(name))
        )
        change = one - other
        found = self._by_place(change.square() + (noise - quiet).abs(), torch.zeros_like(change), change)
        return replace(found, axes=tuple(axis for axis in found.axes if axis.name in along))

    def _by_place(self, error: Tensor, floor: Tensor, residual: Tensor) -> Samples:
        """Samples of squares and of signed differences [N, C, H, W] of all frames, coded values from 0 to 1."""
        every, labels = round(1 / self.study.pictures.scale), self.recording.labels
        return axes.samples(
            error * 255**2,
            floor * 255**2,
            residual * 255,
            self.study.pictures.real,
            self.study.yardstick.counted,
            None if labels is None else labels[:, ::every, ::every][:, : residual.shape[-2], : residual.shape[-1]],
        )

    def light(self, hypothesis: Hypothesis) -> dict[str, Any] | None:
        """The exposure (EV) of each frame against the simulator's under a hypothesis; None where light is steady."""
        return self._predictor.light(hypothesis)

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats each name would gain: one linear step from the best of a few settings."""
        return self._screen.gains(hypothesis, names)

    def proposals(self) -> Sequence[Names]:
        """Sets that a fit of everything, thinned out, suggests."""
        return self.study.proposals

    def simplify(self, names: Names) -> Sequence[Names]:
        """None: what says the same with fewer effects is among the proposals."""
        return []

    def confusable(self, name: str) -> Names:
        """Effects hard to tell from this one."""
        return confusable(unqualified(name), CAMERA_FITS.items())

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether switching the effect off changes nothing that could be seen above the simulator's tolerance."""
        return self._doubts.negligible(hypothesis, name)

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect sits at a bound, or differs between frames or parts of them more than a camera's does."""
        return self._doubts.suspicious(hypothesis, name)

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether parts of the pictures ask for another size of it, even where no more than noise is left."""
        return self._doubts.contradicted(hypothesis, name)

    def wavers(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: pictures are of one instant."""
        return False

    def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether it is a noise that is hardly any of what is left: what predictions miss may look noisy, too.

        Not where flat fields prove it by themselves.
        """
        if CAMERA_FITS[unqualified(name)].stage != "noise" or name in self.measured:
            return False
        every = range(self.segments)
        left, without = (float(self.excess(each, every).mean()) for each in (hypothesis, hypothesis.without(name)))
        return without - left < _NOISY * (without - 1)

    def intervals(self, hypothesis: Hypothesis) -> Intervals:
        """95 % of every parameter, from how frames differ."""
        return self._uncertainty.intervals(hypothesis)

    @property
    def common_light(self) -> Names:
        """Effects of light that may be in what frames' own lights have in common; none where light is steady."""
        return self._common.names

    def at_bound(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether an effect is as large as it can be."""
        return at_bound(name, hypothesis.values[name])

    def with_common_light(self, hypothesis: Hypothesis, names: Names, segments: Segments) -> Hypothesis:
        """A hypothesis with these effects as they are in the mean of the segments' frames, all else as it is."""
        return replace(hypothesis, values=self._common.fit(hypothesis.values, names, segments))

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
