"""A camera whose ranges widen while the translator that trains under it performs well.

Automatic domain randomization (`vision_s2r.randomize`) for the camera: training draws from within the ranges, and every
few steps the translator is measured at their boundaries, on views that it is not trained on.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from vision_s2r.camera import CAMERA_EFFECTS, Camera, CameraParameters
from vision_s2r.errors import UserError, nearest
from vision_s2r.files import write_table
from vision_s2r.randomize import AdrConfig, AutomaticDomainRandomization, Dimension, dimensions
from vision_s2r.training import Step, ViewSource
from vision_s2r.training.data import PROBE, generator
from vision_s2r.translate.config import CameraAdrConfig

WHERE = "translate.adr.limits"


class CameraAdr:
    """The ranges, and what is measured at their boundaries when.

    How often an effect is on, and values that no limit is given for, are as `camera` has them. Training draws are a
    function of the step's shared generator and the ranges. Those at boundaries are the same in all processes, which
    therefore keep the same ranges. Raises UserError for limits that cannot be.
    """

    def __init__(self, cfg: CameraAdrConfig, camera: Camera, views: ViewSource, seed: int, out: Path) -> None:
        """`views` to measure on; `out`: the folder of the run, for the history of the ranges."""
        self.camera, self.views = camera, views
        self._cfg, self._seed, self._out = cfg, seed, out
        automatic = AdrConfig(cfg.buffer, cfg.threshold_high, cfg.threshold_low, cfg.step, boundary_probability=1.0)
        self.ranges = AutomaticDomainRandomization(
            camera_dimensions(cfg.limits, camera), CAMERA_EFFECTS, automatic, seed
        )
        self.history: list[dict[str, float]] = []  # at each validation: step, width, entropy, ranges by name
        self._steps = 0

    def sample(self, step: Step, batch: int, size: int) -> CameraParameters:
        """Parameters for the pictures of a training step, which the camera sees `size` px high and wide."""
        self._steps = step.index + 1
        rng = np.random.default_rng(int(torch.randint(2**62, (1,), generator=step.shared)))
        given = _tensors(self.ranges.sample(batch, rng))
        return self.camera.sample(batch, step.shared, size, size, given)

    def due(self, step: Step) -> bool:
        """Whether the boundaries are measured at this step."""
        return step.index % self._cfg.every == 0

    def probe(self, step: Step) -> tuple[Tensor, CameraParameters, np.ndarray]:
        """Scenes int64 [K] to measure on, what the camera does to each, and at which boundary that is [K].

        The effect of the boundary is on; the others are on as often as in training.
        """
        count, size = self._cfg.probes, self.views.source_size
        scenes = (step.index // self._cfg.every * count + torch.arange(count)) % len(self.views)
        draw = self.ranges.draw(count)
        at = [self.ranges.dimensions[number // 2].effect for number in draw.boundary]
        on = {name: torch.tensor([each == name for each in at]) for name in set(at)}
        random = generator(PROBE, self._seed, step.index)
        return scenes, self.camera.sample(count, random, size, size, _tensors(draw.values), on), draw.boundary

    def metrics(self) -> dict[str, float]:
        """Mean share of the limits that the ranges cover (width); its log's mean (entropy, nats) once it is finite."""
        found = {"width": float(np.diff(self.ranges.bounds).mean()), "entropy": self.ranges.entropy}
        return {name: value for name, value in found.items() if math.isfinite(value)}

    def note(self) -> Path:
        """Add the ranges of the moment to the history, and write it: adr.csv, a row a validation."""
        row: dict[str, float] = {"step": self._steps, "entropy": self.ranges.entropy} | self.metrics()
        for effect, given in self.ranges.ranges().items():
            for key, (low, high) in given.items():
                row |= {f"{effect}.{key} low": low, f"{effect}.{key} high": high}
        self.history.append(row)
        return write_table(self._out / "adr.csv", self.history)

    def state(self) -> dict[str, Any]:
        """Plain values: all that the future depends on besides the configuration."""
        return {"ranges": self.ranges.state(), "history": self.history, "steps": self._steps}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on exactly where `state` was taken."""
        self.ranges.restore(state["ranges"])
        self.history, self._steps = list(state["history"]), state["steps"]


def camera_dimensions(limits: Mapping[str, Mapping[str, Any]], camera: Camera) -> list[Dimension]:
    """A dimension for each limit; UserError for an effect that the camera has not, and limits that cannot be."""
    found = dimensions(limits, CAMERA_EFFECTS, {}, WHERE)
    for name in limits:
        if name not in camera.ranges:
            raise UserError(f"{WHERE}: the camera has no {name}: {nearest(name, camera.ranges)}")
    return found


def _tensors(samples: Mapping[str, Mapping[str, np.ndarray]]) -> dict[str, dict[str, Tensor]]:
    return {name: {key: torch.from_numpy(each) for key, each in given.items()} for name, given in samples.items()}
