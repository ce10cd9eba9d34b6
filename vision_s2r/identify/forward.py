"""The forward method: what the simulator predicts against what was recorded, for every effect.

The likelihood of the residual of an observer that leaks a little of the measured state, as in the diagnosis.
"""

from vision_s2r.fit.case import Hypothesis, Segments
from vision_s2r.fit.gap import ADEQUATE, rest
from vision_s2r.fit.joint.case import JointCase
from vision_s2r.fit.joint.discrepancy import OWN
from vision_s2r.fit.joint.uncertainty import BlockScores, covariance, reach
from vision_s2r.identify.estimate import Offsets, ParameterEstimates, offsets


class Forward:
    """Fits of the effects of `fitted`, which is their fit to all segments."""

    def __init__(self, case: JointCase, fitted: Hypothesis) -> None:
        self._case, self._fitted = case, fitted

    def estimate(self) -> ParameterEstimates:
        """From all segments; where something is left, as sure as another motion would find them."""
        case, fitted = self._case, self._fitted
        left = rest(case.excess(fitted, range(case.segments))) > ADEQUATE
        scores = (case.scores_elsewhere if left else case.scores)(fitted)
        intervals = (case.intervals_elsewhere if left else case.intervals)(fitted)
        labels = tuple((c.effect, c.parameter) for c in scores.space.coordinates)
        return ParameterEstimates(fitted, intervals, labels, covariance(scores), self._offsets(scores), left)

    @staticmethod
    def _offsets(scores: BlockScores) -> Offsets:
        reaches, owners = reach(scores), scores.space.owner
        own = {name: [k for k, owner in enumerate(owners) if owner == each] for name, each in OWN.items()}
        return {name: offsets(scores.point[at], reaches[at]) for name, at in own.items() if at}

    def fit(self, segments: Segments) -> Hypothesis:
        """From some segments."""
        return self._case.fit(frozenset(self._fitted.values), segments, self._fitted)
