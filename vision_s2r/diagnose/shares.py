"""The gap on episodes or frames that no fit has seen, and whose it is: Shapley's shares of the effects."""

from collections.abc import Callable

import numpy as np

from vision_s2r.diagnose.assess import Assessor
from vision_s2r.fit.case import NOMINAL, Case, Hypothesis, Names, Segments
from vision_s2r.statistics import shapley

Measure = Callable[[Hypothesis, Segments], np.ndarray]  # of segments


def held_out(
    case: Case, assessor: Assessor, folds: tuple[Hypothesis, ...], measure: Measure | None = None
) -> np.ndarray:
    """Mean squared error [segments], or another measure, each segment under the fit that has not seen it."""
    found, measure = np.empty(case.segments), measure or case.error
    for held, hypothesis in zip(assessor.folds, folds, strict=True):
        found[list(held)] = measure(hypothesis, held)
    return found


def closed(case: Case, assessor: Assessor, of: Names, folds: tuple[Hypothesis, ...]) -> dict[str, np.ndarray]:
    """The part [segments] of the squared gap that each name closes: Shapley's value over the orders of adding them.

    Parameters stay those of the folds, which have the names `of`; a set's worth is the fall of the error when it is
    switched on. With eight names or more, names beyond the seven of most effect are added last.
    """

    def left(names: Names) -> np.ndarray:
        return held_out(case, assessor, tuple(reduced(fold, names, of) for fold in folds))

    names = sorted(of, key=lambda name: float(left(frozenset({name})).mean()))
    players, last = names[:7], names[7:]
    parts = shapley(players, lambda on: -left(on))
    on = frozenset(players)
    for name in last:
        parts[name] = left(on) - left(on | {name})
        on |= {name}
    return parts


def reduced(hypothesis: Hypothesis, names: frozenset[str], of: frozenset[str]) -> Hypothesis:
    """The hypothesis without those of the names `of` that are not in `names`."""
    off = of - names
    if not names:
        return NOMINAL
    values = {name: value for name, value in hypothesis.values.items() if name not in off}
    return Hypothesis(values, {key: value for key, value in hypothesis.extra.items() if key not in off})
