"""Two sets of pictures without a scene in common as a case of the diagnosis."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from vision_s2r.camera.camera import default_intrinsics
from vision_s2r.effects import Effect, Parameter
from vision_s2r.errors import UserError
from vision_s2r.fit.camera.effect import CAMERA_FITS, Optics
from vision_s2r.fit.camera.quantization import jpeg_quality
from vision_s2r.fit.camera.surfaces import library_of
from vision_s2r.fit.case import Experiment, Hypothesis, Intervals, Names, Samples, Segments, confusable
from vision_s2r.fit.unpaired import space
from vision_s2r.fit.unpaired.axes import axes
from vision_s2r.fit.unpaired.intervals import intervals
from vision_s2r.fit.unpaired.reference import Reference, reference
from vision_s2r.fit.unpaired.simulated import SimulatedSet
from vision_s2r.fit.unpaired.summary import PictureStatistics, Statistic
from vision_s2r.recording import CameraRecording
from vision_s2r.threads import one_thread

DISCREPANCIES = {  # each moves the statistics of its group at will
    "unknown tone": "a tone or colour that no exposure, gamma or white balance gives",
    "unknown shading": "light over the picture that no vignetting or even gradient gives",
    "unknown sharpness": "a spectrum that no known blur gives",
    "unknown noise": "noise that depends on brightness or colour as no sensor's does",
}
_GROUP = dict(zip(("tone", "position", "spectrum", "noise"), DISCREPANCIES, strict=True))
UNEXPLAINED = "unexplained"  # among what may be contents
CONTENT = 1.5  # standard deviations between pictures: fuller, emptier tables and other things on them move no more
_LEAST_SEEN = 0.9  # of the simulator's pictures must mean a pixel for it to count
_LEAST_REGION = 0.2  # of the pixels must count
_MOST_PICTURES, _LEAST_PICTURES = 48, 8  # of the simulator's that a camera takes: more cost time and tell little
_STANDARD = 12.0  # pictures that a comparison of two sets of 24 is worth
_PIXELS = 1_500_000  # that these may have in all, but for the least number of them …
_SEEN = 8  # … and so many times that of those whose statistics are known as they are


@dataclass(frozen=True)
class UnpairedStudy:
    """What is known of a recording once both of its sets have been looked at."""

    statistics: tuple[Statistic, ...]
    real: np.ndarray  # [N, K] statistics of the real pictures
    jpeg: tuple[int, float] | None  # quality and evidence
    not_excited: Mapping[str, str]
    reference: Reference


class UnpairedCase:
    """Two sets of pictures beside the camera's effects; segments are the real pictures.

    The gap is how far the statistics of a real picture lie from the mean of the simulator's set, root mean square, in
    standard deviations between pictures (and of what no simulator gets right); about 1 where only the scenes differ.
    """

    kind = "camera"
    sharp = True
    replaced: Mapping[str, float] = {}
    unsteady = ""
    allowance = 0.0
    rough: Names = frozenset()
    guessed: Names = frozenset()
    measured: Mapping[str, float] = {}
    motions: int = 1
    refitted: Names = frozenset()
    metric = "statistics_distance"
    unit = "σ"
    described = (
        "statistics of each real picture (tones, light over the picture, spectrum, noise by brightness, the 8 px grid) "
        "against their mean over the simulator's set, in standard deviations between pictures; the floor is how far "
        "real pictures lie from each other's mean, for no two show the same scene"
    )

    @classmethod
    def open(cls, recording: CameraRecording, library: Mapping[str, Effect]) -> "UnpairedCase":
        """Look at both sets and fit a camera with every effect first: tens of seconds.

        Raises UserError where the simulator's pictures mean too little of what the camera sees.
        """
        library = library_of(recording, library)
        with one_thread():
            return cls(recording, library, _study(recording, library))

    def __init__(self, recording: CameraRecording, library: Mapping[str, Effect], study: UnpairedStudy) -> None:
        self.library = library
        self.segments = len(recording)
        self.discrepancies = {discrepancy: DISCREPANCIES[discrepancy] for discrepancy in _GROUP.values()}
        self.not_excited = study.not_excited
        self.certain = {"jpeg_compression": study.jpeg[1]} if study.jpeg else {}
        self._lattice_would_show = recording.bits == 8
        self._real, self._statistics = study.real, study.statistics
        self._groups = [each.group for each in study.statistics]
        self._fitter, self._proposed = study.reference.fitter, study.reference.proposed
        self._fits: dict[tuple[Names, tuple[int, ...]], Hypothesis] = {}

    def session(self) -> AbstractContextManager[None]:
        """To be held while methods are called: pictures are so small that torch is best kept to one thread."""
        return one_thread()

    def unit_of(self, parameter: Parameter) -> str:
        """The parameter's own unit."""
        return parameter.unit

    def fit(self, names: Names, segments: Segments, start: Hypothesis | None) -> Hypothesis:
        """The most likely parameters of these effects and discrepancies on these segments; `start` is near, or None."""
        key = (names, tuple(segments))
        if key not in self._fits:
            target, free = self._real[list(segments)].mean(0), self._free(names)
            effects = names & frozenset(self.library)
            whole = len(segments) == self.segments
            values = self._fitter.fit(target, effects, free, start.values if start else {}, 20 if whole else 4)
            offset = target - self._fitter.mean(values)
            extra = {
                name: offset * self._free(frozenset({name})) for name in sorted(names & frozenset(self.discrepancies))
            }
            self._fits[key] = Hypothesis({name: values[name] for name in sorted(values)}, extra)
        return self._fits[key]

    def loglik(self, hypothesis: Hypothesis, segments: Segments) -> list[np.ndarray]:
        """Of each real picture, its log-likelihood [1] (nats).

        Gaussian, between pictures; weakened by what the mean of the simulator's set itself is uncertain.
        """
        white = self._white(hypothesis, segments)
        weight = self._fitter.pictures / self.segments
        return [np.array([-0.5 * weight * float(row @ row)]) for row in white]

    def excess(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """1 and how much further [segments] pictures are from the simulator's mean than from theirs.

        In the variances between pictures, scaled so that chance makes as much of it whatever the number of pictures.
        One picture alone tells next to nothing of a mean: these segments have theirs.
        """
        far, own = self._white(hypothesis, segments), self._fitter.scatter.whitened(self._own(segments))
        more = float((far**2).mean() - (own**2).mean())
        return np.full(len(segments), 1 + (self._fitter.pictures / _STANDARD) * more)

    def error(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        """Mean over the statistics of the squared distance [segments] from the simulator's mean, in deviations."""
        return ((self._differences(hypothesis, segments) / self._fitter.scatter.deviation) ** 2).mean(1)

    def floor(self, segments: Segments) -> np.ndarray:
        """The same [segments] from the mean of the other real pictures, which a perfect simulator would show."""
        return ((self._own(segments) / self._fitter.scatter.deviation) ** 2).mean(1)

    def samples(self, hypothesis: Hypothesis) -> Samples:
        """Picture by picture and statistic by statistic, on the axes of paired pictures."""
        segments = range(self.segments)
        deviation = self._fitter.scatter.deviation
        error = (self._differences(hypothesis, segments) / deviation) ** 2
        floor = (self._own(segments) / deviation) ** 2
        segment = np.repeat(np.arange(self.segments), len(deviation))
        return Samples(error.ravel(), floor.ravel(), segment, axes(self._statistics, self.segments))

    def moved(self, hypothesis: Hypothesis, name: str) -> Samples | None:
        """What an effect changes of the mean of each statistic, along the axes of its definition."""
        # Of how far from the centre something is, statistics know the corners alone, a place of region.
        along = {"region" if axis == "radius" else axis for axis in CAMERA_FITS[name].along}
        if not along:
            return None
        change = self._fitter.mean(hypothesis.values) - self._fitter.mean(hypothesis.without(name).values)
        error = np.tile((change / self._fitter.scatter.deviation) ** 2, self.segments)
        segment = np.repeat(np.arange(self.segments), len(change))
        found = (axis for axis in axes(self._statistics, self.segments) if axis.name in along)
        return Samples(error, np.zeros(len(error)), segment, tuple(found))

    def screen(self, hypothesis: Hypothesis, names: Sequence[str]) -> dict[str, float]:
        """About how many nats adding each of these names to the hypothesis would gain, all segments; cheap."""
        target, free = self._real.mean(0), self._free(frozenset(hypothesis.extra))
        return {name: self._gain(target, free, hypothesis, name) for name in names}

    def _gain(self, target: np.ndarray, free: np.ndarray, hypothesis: Hypothesis, name: str) -> float:
        if name == "jpeg_compression" and self._lattice_would_show:
            return 0.0
        if name in self.discrepancies:
            difference = target - self._fitter.mean(hypothesis.values)
            more = free | self._free(frozenset({name}))
            return self._fitter.loss(difference, free) - self._fitter.loss(difference, more)
        return self._fitter.gain(target, free, hypothesis.values, name)

    def proposals(self) -> Sequence[Names]:
        """What is left of a camera with every effect when those that hardly matter are taken out."""
        return self._proposed

    def simplify(self, names: Names) -> Sequence[Names]:
        """None."""
        return []

    def confusable(self, name: str) -> Names:
        """Effects known to be hard to tell from this one."""
        return confusable(name, space.shown().items()) & self.library.keys()

    def negligible(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether the effect, at these parameters, is smaller than this simulator's own tolerance."""
        return name in hypothesis.values and space.negligible(name, hypothesis.values[name], self._fitter.optics.width)

    def suspicious(self, hypothesis: Hypothesis, name: str) -> bool:
        """Whether a parameter sits at its bound."""
        return name in hypothesis.values and space.at_bound(name, hypothesis.values[name])

    def contradicted(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: what is explained is not asked again."""
        return False

    def wavers(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: pictures are of one instant."""
        return False

    def may_vanish(self, hypothesis: Hypothesis, name: str) -> bool:
        """No: a camera has it in all its pictures."""
        return False

    def intervals(self, hypothesis: Hypothesis) -> Intervals:
        """95 % of every parameter of `values`, from how it varies over the pictures of both sets."""
        return intervals(self._fitter, self._real, hypothesis.values, self._free(frozenset(hypothesis.extra)))

    def contents(self, simulator: Hypothesis, names: Names, left: bool) -> list[dict[str, Any]]:
        """Which of these effects, and whether what is `left`, may as well be contents that differ between the sets.

        What moves no statistic by more than pictures of one place differ by, or not by much: with other things in them,
        or more, such a set is one that the same camera may take.
        """
        mean = self._fitter.mean
        moved = {name: mean(simulator.values) - mean(simulator.without(name).values) for name in sorted(names)}
        if left:
            moved[UNEXPLAINED] = self._real.mean(0) - mean(simulator.values)
        spread = self._real.std(axis=0, ddof=1) + 1e-9
        found = []
        for name, shift in moved.items():
            most = int(np.argmax(np.abs(shift) / spread))
            size = float(abs(shift[most]) / spread[most])
            if size < CONTENT:
                each = self._statistics[most]
                found.append({"name": name, "statistic": f"{each.group}, {each.label}", "shift": size})
        return found

    def experiment(self, rivals: Sequence[Hypothesis], not_excited: Sequence[str]) -> Experiment:
        """How many more pictures tell the rivals apart, and what pairs would show."""
        advice = []
        for rival in rivals[1:2]:
            difference = self._fitter.mean(rivals[0].values) - self._fitter.mean(rival.values)
            free = self._free(frozenset(rivals[0].extra) | frozenset(rival.extra))
            nats = max(self._fitter.loss(difference, free) / self._fitter.pictures, 1e-3)  # a picture of each set
            needed = int(np.ceil(2 * 16.0 / nats))
            one, other = (", ".join(sorted(each.values)) or "none" for each in (rivals[0], rival))
            advice.append(
                f"To tell {one} from {other}: {max(needed, 2 * self.segments)} pictures in each set"
                + (", better of flat, evenly lit charts" if needed > 500 else "")
                + "."
            )
        if not_excited:
            advice.append(
                f"To see {', '.join(not_excited)}: pairs, at least 16 scenes that the simulator renders from the "
                "camera's own pose."
            )
        return Experiment(" ".join(advice))

    def _free(self, names: Names) -> np.ndarray:
        """The statistics [K] (bool) that the discrepancies among these names move."""
        return np.array([_GROUP.get(group) in names for group in self._groups])

    def _differences(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        offset = sum((np.asarray(value) for value in hypothesis.extra.values()), np.zeros(len(self._groups)))
        return self._real[list(segments)] - self._fitter.mean(hypothesis.values) - offset

    def _white(self, hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        return self._fitter.scatter.whitened(self._differences(hypothesis, segments))

    def _own(self, segments: Segments) -> np.ndarray:
        """Differences [segments, K] from the mean of the other real pictures."""
        whole = self._real.mean(0)
        return (self._real[list(segments)] - whole) * (self.segments / (self.segments - 1))


def _study(recording: CameraRecording, library: Collection[str]) -> UnpairedStudy:
    height, width = recording.real.shape[1:3]
    summary = PictureStatistics(height, width, recording.encoding, recording.grey, _region(recording))
    real = summary(torch.from_numpy(np.ascontiguousarray(recording.real)).permute(0, 3, 1, 2).contiguous())
    fits = {name: CAMERA_FITS[name] for name in library}
    not_excited = {name: fit.unpaired for name, fit in fits.items() if isinstance(fit.unpaired, str)}
    if recording.grey:
        coloured = [name for name, fit in fits.items() if "colour" in fit.needs]
        not_excited = dict.fromkeys(coloured, "the pictures are grey") | not_excited
    jpeg = jpeg_quality(recording.real) if recording.bits == 8 and "jpeg_compression" in library else None
    fixed = {"jpeg_compression": {"quality": float(jpeg[0])}} if jpeg else {}
    fit_in = _PIXELS // (height * width)
    most = max(_LEAST_PICTURES, min(_MOST_PICTURES, fit_in))
    larger = SimulatedSet(recording, summary, max(most, _SEEN * fit_in))
    pictures = SimulatedSet(recording, summary, most).within(larger)
    intrinsics = default_intrinsics(height, width) if recording.intrinsics is None else recording.intrinsics
    optics = Optics(width, height, float(intrinsics[:2].mean()))
    names = frozenset(library) - not_excited.keys()
    found = reference(real, pictures, summary.statistics, optics, len(larger), fixed, names)
    return UnpairedStudy(summary.statistics, real, jpeg, not_excited, found)


def _region(recording: CameraRecording) -> np.ndarray | None:
    """The pixels [H, W] that the simulator's pictures mean, by and large; UserError where they are too few."""
    if recording.mask is None:
        return None
    region = recording.mask.mean(0) >= _LEAST_SEEN
    if region.mean() < _LEAST_REGION:
        raise UserError(
            f"mask/: only {region.mean():.0%} of the pixels are meant in {_LEAST_SEEN:.0%} of sim/, "
            f"expected {_LEAST_REGION:.0%} of an unpaired recording"
        )
    return region
