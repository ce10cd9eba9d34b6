"""How far a value hangs on the optimum that a fit has ended in, and on a force or a friction that it lacks.

Which corner hits first gives a likelihood of real tosses many optima, some as good as the one that a fit has ended in,
and what nobody has modelled bends values. Other tosses have another best optimum, and more or less of that. The
interval of one fit knows of neither, and leaving tosses out in turn hardly moves it.
"""

from collections.abc import Callable

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.contact.discrepancy import MEANINGS
from vision_s2r.fit.contact.fitter import ContactFitter, names_of
from vision_s2r.statistics import lower_bound

STARTS = 16  # of fits, beside the one that is asked about …
ASIDE = 0.35  # … up to so far from it in each parameter, relative
SURE = 0.975  # that the best optimum is better by more than chance

LogLikelihood = Callable[[Hypothesis], np.ndarray]  # of each toss [E], nats


def optima(fitter: ContactFitter, hypothesis: Hypothesis, loglik: LogLikelihood) -> list[Hypothesis]:
    """Other fits around a hypothesis that are not surely worse than the best of all."""
    names, every = names_of(hypothesis), range(fitter.count)
    space = fitter.space(names)
    point = space.start(hypothesis)
    sizes, rng = space.sizes(point), np.random.default_rng(0)
    ends = [hypothesis]
    for _ in range(STARTS):
        start = point.copy()
        start[: len(sizes)] += rng.uniform(-ASIDE, ASIDE, len(sizes)) * sizes
        start = np.clip(start, space.low, space.high)
        ends.append(fitter.fit(names, every, space.hypothesis(start, hypothesis.extra)))
    nats = [loglik(each) for each in ends]
    best = max(nats, key=np.sum)
    return [each for each, its in zip(ends[1:], nats[1:], strict=True) if lower_bound(best - its, SURE, 0) <= 0]


def beside_unknowns(fitter: ContactFitter, hypothesis: Hypothesis, loglik: LogLikelihood) -> list[Hypothesis]:
    """Fits of a hypothesis and one unknown more that it lacks, where they are likelier."""
    names, every = names_of(hypothesis), range(fitter.count)
    without = loglik(hypothesis).sum()
    fits = [fitter.fit(names | {unknown}, every, hypothesis) for unknown in sorted(MEANINGS.keys() - names)]
    return [each for each in fits if loglik(each).sum() > without]
