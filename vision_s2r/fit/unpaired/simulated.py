"""The simulator's set of pictures as a camera would take it, and the statistics that it then has."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vision_s2r.camera import Camera, CameraParameters
from vision_s2r.camera.colour import Curve
from vision_s2r.camera.effects.jpeg_compression import libjpeg
from vision_s2r.fit.case import Values
from vision_s2r.fit.unpaired.summary import PictureStatistics
from vision_s2r.recording import CameraRecording

BASE_NOISE = (0.0, 0.25 / 255, 0.5 / 255, 0.75 / 255)  # that any camera may have, of coded values; no effect
_DOUBT = 0.15 / 255  # of it
KEPT = 4000  # predictions remembered
PIECE = 50  # pictures at a time


class SimulatedSet:
    """`sim/` of a recording: its statistics under any effects, the same noise every time.

    Effects change pictures of different scenes much alike: a few are taken through the camera, and what the others'
    statistics are apart from theirs stays. Thread-safe: two threads at most compute a prediction twice.
    """

    def __init__(
        self,
        recording: CameraRecording,
        summary: PictureStatistics,
        most: int,
        base_noise: float = 0.5 / 255,
        curve: Curve | None = None,
        apart: np.ndarray | None = None,
    ) -> None:
        """Of at most `most` of its pictures, evenly chosen, with `base_noise` of a camera without noise effects.

        `curve` is that of its values, the recording's own unless given. `apart` [K] is how the mean statistics of more
        of its pictures differ from theirs; None: nothing is known.
        """
        self._recording, self._most, self._base = recording, most, base_noise
        self._apart = np.zeros(len(summary.statistics)) if apart is None else apart
        self._summary = summary
        chosen = np.linspace(0, len(recording.sim) - 1, min(len(recording.sim), most)).round().astype(int)
        self._pictures = torch.from_numpy(recording.sim[chosen]).permute(0, 3, 1, 2).contiguous()
        self.curve: Curve = curve or recording.encoding
        self._camera = Camera(encoding=self.curve)
        self._full = 2.0**recording.bits - 1
        self._grey = recording.grey
        intrinsics = recording.intrinsics
        self._intrinsics = None if intrinsics is None else torch.from_numpy(intrinsics).expand(len(self), 4)
        generator = torch.Generator().manual_seed(0)
        self._noise = torch.randn(self._pictures.shape, generator=generator)
        if self._grey:
            self._noise = self._noise[:, :1].expand_as(self._noise)
        self._known: dict[tuple[object, ...], np.ndarray] = {}

    def __len__(self) -> int:
        return len(self._pictures)

    def statistics(self, values: Values, pictures: Sequence[int] | None = None) -> np.ndarray:
        """Statistics [B, K] of these of the simulator's pictures (all unless given) under effects."""
        chosen = tuple(range(len(self)) if pictures is None else pictures)
        key = (chosen, *sorted((name, *given.items()) for name, given in values.items()))
        if key not in self._known:
            if len(self._known) >= KEPT:
                self._known.pop(next(iter(self._known)), None)
            self._known[key] = self._summary(self.taken(values, chosen))
        return self._known[key]

    def mean(self, values: Values) -> np.ndarray:
        """Mean statistics [K] under effects, of all pictures that were looked at."""
        return self.statistics(values).mean(0) + self._apart

    def within(self, larger: "SimulatedSet") -> "SimulatedSet":
        """The same set, knowing what a larger one of the same pictures is like."""
        pieces = range(0, len(larger), PIECE)
        whole = np.concatenate([larger.statistics({}, range(len(larger))[k : k + PIECE]) for k in pieces])
        apart = whole.mean(0) - self.statistics({}).mean(0)
        return self._with(apart=apart)

    def with_base_noise(self, level: float) -> "SimulatedSet":
        """The same set with another noise of a camera without noise effects."""
        return self._with(base_noise=level)

    def with_curve(self, curve: Curve) -> "SimulatedSet":
        """The same set before a camera of another maker's curve."""
        return self._with(curve=curve)

    def _with(self, **changes: Any) -> "SimulatedSet":
        kept = {"base_noise": self._base, "curve": self.curve, "apart": self._apart}
        return SimulatedSet(self._recording, self._summary, self._most, **(kept | changes))

    def base_noise_doubt(self, values: Values) -> np.ndarray:
        """Standard deviation of the mean statistics [K], all moving together, since that noise is not known exactly."""
        less, more = max(self._base - _DOUBT, 0.0), self._base + _DOUBT
        statistics = [self.with_base_noise(level).statistics(values) for level in (less, more)]
        return (statistics[1] - statistics[0]).mean(0) * (_DOUBT / (more - less))

    @torch.no_grad()
    def taken(self, values: Values, pictures: Sequence[int]) -> Tensor:
        """The pictures [B, 3, H, W] that a camera with these effects takes, rounded as the recording's are."""
        chosen = list(pictures)
        before = {name: given for name, given in values.items() if name != "jpeg_compression"}
        parameters = CameraParameters.of(before, len(chosen), torch.tensor(chosen))
        intrinsics = None if self._intrinsics is None else self._intrinsics[chosen]
        seen = self._camera(self._pictures[chosen], parameters, intrinsics=intrinsics)
        if self._grey:
            seen = seen[:, :1].expand_as(seen)  # the noise of one channel, not of three
        coded = ((seen + self._base * self._noise[chosen]).clamp(0, 1) * self._full).round() / self._full
        if "jpeg_compression" not in values:
            return coded
        return libjpeg(coded, torch.full((len(chosen),), values["jpeg_compression"]["quality"]))
