"""The forward method: what the simulator predicts against what was recorded, for every effect.

The likelihood of the residual of an observer that leaks a little of the measured state, as in the diagnosis.
"""

from vision_s2r.fit.case import Hypothesis, Segments
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.discrepancy import OWN
from vision_s2r.fit.joint.uncertainty import BlockScores, covariance, reach
from vision_s2r.identify.estimate import Offsets, ParameterEstimates, offsets


class Forward:
    """Fits of the effects of `fitted`, which is their fit to all segments."""

    def __init__(self, case: JointCase, fitted: Hypothesis) -> None:
        self._case, self._fitted = case, fitted

    def estimate(self) -> ParameterEstimates:
        """From all segments."""
        scores = self._case.scores(self._fitted)
        labels = tuple((c.effect, c.parameter) for c in scores.space.coordinates)
        return ParameterEstimates(
            self._fitted, self._case.intervals(self._fitted), labels, covariance(scores), self._offsets(scores)
        )

    @staticmethod
    def _offsets(scores: BlockScores) -> Offsets:
        reaches, owners = reach(scores), scores.space.owner
        own = {name: [k for k, owner in enumerate(owners) if owner == each] for name, each in OWN.items()}
        return {name: offsets(scores.point[at], reaches[at]) for name, at in own.items() if at}

    def fit(self, segments: Segments) -> Hypothesis:
        """From some segments."""
        return self._case.fit(frozenset(self._fitted.values), segments, self._fitted)
