"""Effects of light that all frames share, where each has a light of its own besides: means, about which frames scatter.

What frames have of their own hides such effects from predictions that allow for it. They are seen in the simulator's
one light, where every frame is a single witness, however many pixels it has.
"""

from dataclasses import replace

import torch

from vision_s2r.fit.camera.coordinates import starts
from vision_s2r.fit.camera.effect import NEEDS
from vision_s2r.fit.camera.fitting import Target, best_start, gauss_newton
from vision_s2r.fit.camera.intervals import spread
from vision_s2r.fit.camera.light import STEADY
from vision_s2r.fit.camera.study import Study
from vision_s2r.fit.case import Intervals, Names, Segments, Values

_ITERATIONS = 12


class CommonLight:
    """Fits of what frames' lights have in common beside everything else that a hypothesis has, which stays."""

    def __init__(self, study: Study, target: Target) -> None:
        """`target` is what the case's other fits compare with."""
        self._study = study
        self._steady = replace(target, pictures=replace(target.pictures, light=STEADY))

    @property
    def names(self) -> Names:
        """Effects that nothing but frames' own lights hides."""
        why, hidden = self._study.not_excited, NEEDS["steady light"].lacking
        return frozenset(name for name in self._study.pictures.light.hides if why.get(name) == hidden)

    @torch.inference_mode()
    def fit(self, values: Values, names: Names, segments: Segments) -> Values:
        """`values` with these effects as they are in the mean of the segments' frames."""
        target = self._scattering(values)
        found = {name: value for name, value in values.items() if name not in names}
        for name in sorted(names):
            found = dict(best_start(target, found, name, segments, starts(name, target.pictures.optics)))
        return gauss_newton(target, found, sorted(names), segments, _ITERATIONS)[0]

    @torch.inference_mode()
    def intervals(self, values: Values) -> Intervals:
        """Of those of its effects that there are, 95 % of what the mean of other frames would be."""
        common = sorted(self.names & values.keys())
        found = spread(self._scattering(values), self._study, values).intervals if common else {}
        return {name: found[name] for name in common}

    def _scattering(self, values: Values) -> Target:
        """In one light for all frames, whose own are what residuals are made of: a pixel is no outlier for that."""
        every = range(self._study.count)
        squared = [float((self._steady.compare(values, [k])[0].square() * self._counted(k)).sum()) for k in every]
        pixels = sum(float(self._counted(k).sum()) for k in every) * self._steady.pictures.real.shape[1]
        variance = torch.full_like(self._steady.variance, sum(squared) / max(pixels, 1.0))
        return replace(self._steady, variance=variance)

    def _counted(self, segment: int) -> torch.Tensor:
        return self._steady.counted[[segment]]
