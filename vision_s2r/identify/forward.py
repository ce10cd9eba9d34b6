"""The forward method: what the simulator predicts against what was recorded, for every effect.

The likelihood of the residual of an observer that leaks a little of the measured state, as in the diagnosis.
"""

from vision_s2r.diagnose.case import Hypothesis, Units
from vision_s2r.diagnose.joint import JointCase
from vision_s2r.diagnose.joint.uncertainty import covariance
from vision_s2r.identify.estimate import Estimate


class Forward:
    """Fits of the effects of `fitted`, which is their fit to all units."""

    def __init__(self, case: JointCase, fitted: Hypothesis) -> None:
        self._case, self._fitted = case, fitted

    def estimate(self) -> Estimate:
        """From all units."""
        scores = self._case.scores(self._fitted)
        labels = tuple((c.effect, c.parameter) for c in scores.space.coordinates)
        return Estimate(self._fitted, self._case.intervals(self._fitted), labels, covariance(scores))

    def fit(self, units: Units) -> Hypothesis:
        """From some units."""
        return self._case.fit(frozenset(self._fitted.values), units, self._fitted)
