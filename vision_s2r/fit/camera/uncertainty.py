"""How sure a camera's parameters are: how frames differ, and for what is fitted apart, the jackknife."""

import numpy as np
import torch
from scipy.special import stdtrit

from vision_s2r.fit.camera.common_light import CommonLight
from vision_s2r.fit.camera.effect import APART, CAMERA_FITS, at_stage
from vision_s2r.fit.camera.fitter import CameraFitter
from vision_s2r.fit.camera.intervals import Spread, spread
from vision_s2r.fit.camera.predictor import key_of
from vision_s2r.fit.camera.study import Study
from vision_s2r.fit.case import Hypothesis, Intervals, Values

_GRAIN = 0.03  # of a grain's strength and length, that its form leaves open
_EDGE = 2.0  # px, to which the edge of an area is seen, where it may look like what is behind


class CameraUncertainty:
    """Spreads and intervals of hypotheses, each worked out once."""

    def __init__(self, study: Study, fitter: CameraFitter, common: CommonLight) -> None:
        self._study, self._fitter, self._common = study, fitter, common
        self._spreads: dict[tuple[object, ...], Spread] = {}
        self._intervals: dict[tuple[object, ...], Intervals] = {}

    def intervals(self, hypothesis: Hypothesis) -> Intervals:
        """95 % of every parameter, from how frames differ."""
        key = key_of(hypothesis)
        if key not in self._intervals:
            of_light = self._common.intervals(hypothesis.values)
            self._intervals[key] = self.spread(hypothesis).intervals | self._intervals_apart(hypothesis) | of_light
        return self._intervals[key]

    def _intervals_apart(self, hypothesis: Hypothesis) -> Intervals:
        """By leaving out groups of frames in turn (jackknife)."""
        names, groups = at_stage(hypothesis.values, *APART), min(4, self._study.count)
        rest = [[k for k in range(self._study.count) if k % groups != group] for group in range(groups)]
        left = [self._fitter.fit_apart(hypothesis.values, names, some) for some in rest]
        found: Intervals = {}
        for name in names:
            for key, value in hypothesis.values[name].items():
                each = np.array([one[name][key] for one in left])
                deviation = np.sqrt((groups - 1) / groups * np.sum((each - each.mean()) ** 2))
                least = _GRAIN * value
                if CAMERA_FITS[name].stage == "area":
                    least = _EDGE / self._study.pictures.scale + _blurred(hypothesis.values)
                half = max(stdtrit(groups - 1, 0.975) * float(deviation), least)
                found.setdefault(name, {})[key] = (value - half, value + half)
        return found

    def spread(self, hypothesis: Hypothesis) -> Spread:
        """How parameters differ between frames."""
        key = key_of(hypothesis)
        if key not in self._spreads:
            with torch.inference_mode():
                self._spreads[key] = spread(self._fitter.target, self._study, hypothesis.values)
        return self._spreads[key]


def _blurred(values: Values) -> float:
    """How far (px) blurs take an edge."""
    blurs = [(key, value) for name in at_stage(values, "blur") for key, value in values[name].items()]
    return sum(value / 2 if key == "length" else value for key, value in blurs if key in ("radius", "length"))
