"""Whose the gap is: the part that each name of a settled search closes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.search import Found
from vision_s2r.diagnose.shares import closed, held_out, reduced
from vision_s2r.diagnose.simulator import Simulator
from vision_s2r.fit.case import Case, Hypothesis, Names
from vision_s2r.fit.gap import Gap, Share
from vision_s2r.statistics import shapley

LEAST_SHARE = 0.01  # of the gap, that the interval of a name's share must not reach below …
LARGE_SHARE = 0.05  # … unless its share is this large: one that few episodes show reaches 0 by their draw alone
UNKNOWN = "?"  # one more among the names of a set


@dataclass(frozen=True)
class Settled:
    """A search's end, and the simulator that comes of it."""

    found: Found  # its effects are those that matter
    simulator: Simulator
    harmful: Names  # effects that would have been named, but make held-out data worse
    slight: Names  # … and those that are there, but close next to nothing of the gap
    firm: Names  # sure, though the gap may not show it: what is stated of them is of predictions, each segment's alike
    gap: Gap
    parts: dict[str, np.ndarray]  # [segments] of the squared gap that each name closes, by Shapley
    stated: dict[str, np.ndarray]  # … and what is said of each effect: where that is next to nothing, beside all others
    witnessed: Mapping[str, float] = field(default_factory=dict)  # effects that whole frames tell, by evidence in nats
    vague: Names = frozenset()  # guessed parameters that would be causes, but stand in for one that is

    @classmethod
    def of(
        cls,
        case: Case,
        assessor: Assessor,
        found: Found,
        simulator: Simulator,
        firm: Names,
        harmful: Names = frozenset(),
        slight: Names = frozenset(),
    ) -> "Settled":
        """A search's end with this simulator, and whose the gap is."""
        return cls(found, simulator, harmful, slight, firm, *_parts(case, assessor, found, simulator, firm))

    def with_simulator(self, case: Case, assessor: Assessor, simulator: Simulator) -> "Settled":
        """The same with another simulator."""
        gap, parts, stated = _parts(case, assessor, self.found, simulator, self.firm)
        return replace(self, simulator=simulator, gap=gap, parts=parts, stated=stated)

    def share(self, name: str) -> Share:
        """What is said of an effect's part of the gap, with its interval."""
        return _share(self.gap, self.stated[name], name in self.firm)

    def source(self, name: str) -> tuple[Hypothesis, Hypothesis]:
        """The hypothesis that has a name's values, and the fit that says how sure they are."""
        if name in self.simulator.names:
            return self.simulator.hypothesis, self.simulator.assessment.hypothesis
        return self.found.final.hypothesis, self.found.final.hypothesis

    def at(self, hypothesis: Hypothesis) -> "Settled":
        """With other values of names that the simulator has, or is to have."""
        simulator, fit = self.simulator, self.simulator.assessment.hypothesis
        fit = replace(fit, values={**fit.values, **hypothesis.values})
        assessment = replace(simulator.assessment, hypothesis=fit)
        return replace(self, simulator=replace(simulator, hypothesis=hypothesis, assessment=assessment))


def _parts(
    case: Case, assessor: Assessor, found: Found, simulator: Simulator, firm: Names
) -> tuple[Gap, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """The gap, whose it is, and what is said of that."""
    apart = apart_from(case, simulator, firm)
    refitted, before = (held_out(case, assessor, each.folds) for each in (found.refitted, found.nominal))
    gap = Gap(before, refitted, simulator.error, case.floor(range(case.segments)), assessor.seed)
    parts = dict.fromkeys(apart, np.zeros(case.segments)) | closed(case, assessor, simulator.names, simulator.folds)
    plain = found.effects - firm - apart
    sure = _of_predictions(case, assessor, found, firm)
    stated = parts | {name: _stated(case, assessor, simulator, gap, parts, name) for name in plain} | sure
    parts |= {name: part * (gap.before - gap.floor) for name, part in sure.items()}
    return gap, parts, stated


def _stated(
    case: Case, assessor: Assessor, simulator: Simulator, gap: Gap, parts: dict[str, np.ndarray], name: str
) -> np.ndarray:
    """The part [segments] of the squared gap that is said to be a name's."""
    if not is_slight(gap.share(parts[name])):
        return parts[name]
    beside = _beside(case, assessor, simulator, name)
    return parts[name] if is_slight(gap.share(beside)) else beside


def _beside(case: Case, assessor: Assessor, simulator: Simulator, name: str) -> np.ndarray:
    """The part [segments] of the squared gap that a name closes beside all others.

    Shapley's value may be nothing, or less, where an effect helps in the company of another only: blur beside noise.
    """
    others = simulator.names - {name}
    without = tuple(reduced(fold, others, simulator.names) for fold in simulator.folds)
    return held_out(case, assessor, without) - simulator.error


def _of_predictions(case: Case, assessor: Assessor, found: Found, firm: Names) -> dict[str, np.ndarray]:
    """The share [segments] that firm names have in what the search's predictions miss of each segment: Shapley's.

    Beside the unknown, which has a share of its own; a free run has none of that. A segment in which the unknown is
    large does not drown the others.
    """
    if not firm:
        return {}
    final = found.final
    rest = final.names - firm

    def left(on: frozenset[str]) -> np.ndarray:
        names = frozenset(on - {UNKNOWN}) | (rest if UNKNOWN in on else frozenset())
        folds = tuple(reduced(fold, names, final.names) for fold in final.folds)
        return held_out(case, assessor, folds, case.excess)

    parts = shapley([*sorted(firm), UNKNOWN], lambda on: -left(on))
    whole = np.maximum(sum(parts.values()), 1e-12)
    return {name: np.clip(parts[name] / whole, 0.0, 1.0) for name in firm}


def _share(gap: Gap, part: np.ndarray, alike: bool) -> Share:
    """The share of the gap that a part [segments] is; or the mean of shares, of segments that are `alike`."""
    return replace(gap, before=np.ones(len(part)), floor=np.zeros(len(part))).share(part) if alike else gap.share(part)


def is_slight(share: Share) -> bool:
    """Whether an effect of this share of the gap closes too little of it to be named."""
    return share.ci[0] < LEAST_SHARE and share.value < LARGE_SHARE


def apart_from(case: Case, simulator: Simulator, firm: Names) -> Names:
    """Names that are there, whether or not a free run is better for them, and are in none."""
    return frozenset(case.certain) - simulator.names - firm
