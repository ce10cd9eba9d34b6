"""Names for what the lights of a camera's frames have in common, where each frame has a light of its own besides."""

from dataclasses import replace
from typing import Any

import numpy as np

from vision_s2r.diagnose.assess import Assessor
from vision_s2r.diagnose.guesses import as_believed
from vision_s2r.diagnose.settled import Settled, is_slight
from vision_s2r.diagnose.shares import held_out
from vision_s2r.diagnose.simulator import BETTER, surely
from vision_s2r.fit.case import Hypothesis, Names, Segments


def with_common_light(case: Any, assessor: Assessor, settled: Settled) -> Settled:
    """With the effects of light of a CameraCase that frames which no fit has seen are surely better with.

    Of those that do about as well, that whose form shows in each frame's own light, too, or the fewest parameters: a
    shadow has an edge, and one that is larger than the picture is an exposure.
    """
    named = Names()
    while free := sorted(case.common_light - named):
        tried = {name: _with(case, assessor, settled, named | {name}) for name in free}
        most = min(each.simulator.left for each in tried.values()) / BETTER**2
        alike = [name for name, each in tried.items() if each.simulator.left <= most]
        nats = {name: _nats(case, assessor, tried[name]) for name in alike}
        alike = [name for name in alike if nats[name] > max(nats.values()) - assessor.cfg.evidence]
        name = min(alike, key=lambda each: (len(case.library[each].parameters), tried[each].simulator.left))
        best = tried[name]
        before, after = settled.simulator.error, best.simulator.error
        better = surely(assessor, before - after, 1 - BETTER**2, before - case.floor(range(case.segments)))
        vain = as_believed(case, best.simulator.assessment, name) or case.at_bound(best.simulator.hypothesis, name)
        if not better or vain:
            break
        evidence = len(before) / 2 * float(np.log(before.mean() / after.mean()))  # of normal errors, one a frame
        best = best.with_simulator(case, assessor, best.simulator)
        if any(is_slight(best.share(each)) for each in named | {name}):
            break
        settled, named = replace(best, witnessed={**settled.witnessed, name: evidence}), named | {name}
    return settled


def _nats(case: Any, assessor: Assessor, settled: Settled) -> float:
    """The likelihood of frames that no fit has seen, each in its own light."""

    def of(hypothesis: Hypothesis, segments: Segments) -> np.ndarray:
        return np.array([each.sum() for each in case.loglik(hypothesis, segments)])

    return float(held_out(case, assessor, settled.simulator.folds, of).sum())


def _with(case: Any, assessor: Assessor, settled: Settled, common: Names) -> Settled:
    """With these effects of light as they are in the mean of frames; whose the gap is is not worked out yet."""
    every, simulator = range(case.segments), settled.simulator
    whole = case.with_common_light(simulator.hypothesis, common, every)
    folds = tuple(
        case.with_common_light(fold, common, [k for k in every if k not in held])
        for held, fold in zip(assessor.folds, simulator.folds, strict=True)
    )
    simulator = replace(
        settled.at(whole).simulator,
        names=simulator.names | common,
        folds=folds,
        error=held_out(case, assessor, folds),
    )
    found = replace(settled.found, effects=settled.found.effects | common)
    return replace(settled, found=found, simulator=simulator)
