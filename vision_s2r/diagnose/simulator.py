"""A simulator that a search may end with: effects and nominal parameters, and its error on data that it has not seen.

It has no discrepancy terms, which nobody could take over: parameters that were found beside one are found once more
without, or what it did in their place would be missing. Where something is left, an effect has to lower the held-out
error of a simulator whose nominal parameters are all identified without it; with none that does, that one is what the
diagnosis ends with.
"""

from dataclasses import dataclass

import numpy as np

from vision_s2r.diagnose.assess import SURE, Assessment, Assessor
from vision_s2r.diagnose.search import MOST, Found
from vision_s2r.diagnose.shares import held_out, reduced
from vision_s2r.fit.case import Case, Hypothesis, Names
from vision_s2r.statistics import lower_bound

BETTER = 0.95  # times the error, that another simulator must leave to be preferred to the one that was found first


@dataclass(frozen=True)
class Simulator:
    """Effects and nominal parameters with their values."""

    names: Names  # what it has: named effects, and nominal parameters that are refitted beside them
    hypothesis: Hypothesis  # from all segments
    assessment: Assessment  # that this is of, with the discrepancy terms that it had
    folds: tuple[Hypothesis, ...]  # from all segments but those of each fold
    error: np.ndarray  # [segments] mean squared error, each segment under the fold that has not seen it

    @property
    def left(self) -> float:
        """The mean of its squared error."""
        return float(self.error.mean())


def simulator_at_end(case: Case, assessor: Assessor, found: Found, firm: Names) -> Simulator:
    """What the named effects make of the simulator, or one that is merely identified, where that does as well.

    Firm names are in it where it is better for them. The simulator as it came where nothing is to be mended, or all are
    worse.
    """
    nominal = simulator_of(case, assessor, found.nominal, frozenset())
    if not found.effects and assessor.adequate(found.nominal):
        return nominal
    best = simulator_of(case, assessor, found.final, found.final.names - found.unknown - firm)
    if found.is_open:
        effects = best.names - case.refitted  # some may have no name
        identified = _identified(case, assessor, found)
        anew = assessor.one(effects | found.identified.names, found.final.hypothesis)
        best = _better(simulator_of(case, assessor, anew, anew.names), best)
        best = _of_effects(effects - frozenset(case.certain), found.effects, best, identified)
        if firm:  # as they are beside the unknown; or fitted without it, where they leave about as little
            anew = assessor.one(found.effects | found.identified.names, found.final.hypothesis)
            alone = anew.rest <= MOST * max(found.final.rest, assessor.cfg.adequate)
            fits = (found.final, anew) if alone else (found.final,)
            others = [simulator_of(case, assessor, each, each.names - found.unknown) for each in fits]
            best = min(best, *others, key=lambda each: each.left)
    return best if best.left < nominal.left else nominal


def _of_effects(effects: Names, named: Names, best: Simulator, identified: Simulator) -> Simulator:
    """The simulator with these effects or without: named ones have to do no harm there, those without a name help."""
    if not effects:
        return identified
    return _better(identified, best) if effects & named else _better(best, identified)


def _identified(case: Case, assessor: Assessor, found: Found) -> Simulator:
    """No effect but what is certain, and every nominal parameter.

    A gain takes the place of one of them that is no guess, where that says the same. A guess may be as far off as the
    gain: what one motion is better with for its sake, others are worse with.
    """
    whole = found.identified
    for names in case.simplify(whole.names)[:1]:
        if whole.names - names <= case.guessed:
            continue
        gain = assessor.one(names)
        if whole.score - gain.score <= assessor.cfg.evidence:
            return simulator_of(case, assessor, gain, names)
    return simulator_of(case, assessor, whole, whole.names)


def _better(other: Simulator, best: Simulator) -> Simulator:
    return other if other.left < BETTER**2 * best.left else best


def simulator_of(case: Case, assessor: Assessor, assessment: Assessment, names: Names) -> Simulator:
    """The simulator of a fit, with only these of its names."""
    alone = [reduced(each, names, assessment.names) for each in (assessment.hypothesis, *assessment.folds)]
    error = held_out(case, assessor, tuple(alone[1:]))
    return Simulator(names, alone[0], assessment, tuple(alone[1:]), error)


def surely(assessor: Assessor, relief: np.ndarray, share: float, rest: np.ndarray) -> bool:
    """Whether what is gained [segments] is this share of what was left, or more, and surely something."""
    return bool(relief.mean() >= share * rest.mean()) and lower_bound(relief, SURE, assessor.seed) > 0
