"""How large an effect could be that a recording does not show: what "absent" means, in the effect's own unit.

Beside what was found the effect is fitted all the same, and its interval says what the recording leaves room for. A fit
that ends at a size which costs likelihood, since the way back to none is flat or rough, begins again from less.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from vision_s2r.diagnose.assess import Assessment, Assessor
from vision_s2r.diagnose.settled import Settled
from vision_s2r.effects import Parameter
from vision_s2r.fit.case import Case, Hypothesis, intervals_of
from vision_s2r.fit.selection import EVIDENCE

COSTS = 2.0  # nats, that a size has to cost not to be what a recording leaves room for
LESS, TRIES = 0.1, 3  # of the size before, that a fit begins again from, so often


def bounds(case: Case, assessor: Assessor, settled: Settled, names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """By name, of each effect that has a size here: by parameter its `unit` and `ci`, between which it lies (95 %).

    An end of None is one that no size is beyond: a stiffness may be anything above.
    """
    final = settled.found.final
    least = _nats(assessor, final.hypothesis) - COSTS
    found = assessor.run(partial(_bounds, case, assessor, final, least), [(name,) for name in names])
    return {name: each for name, each in zip(names, found, strict=True) if each}


def _bounds(case: Case, assessor: Assessor, final: Assessment, least: float, name: str) -> dict[str, Any]:
    names, every = final.names | {name}, range(case.segments)
    fitted = case.fit(names, every, final.hypothesis)
    if not fitted.values.get(name):
        return {}
    sizes = _sizes(case, fitted, name)
    for _ in range(TRIES):
        if _nats(assessor, fitted) > least:
            break
        fitted = case.fit(names, every, _smaller(fitted, name, sizes))
    intervals = intervals_of(case, fitted, elsewhere=True)[name]
    found = {}
    for size, none in sizes.items():
        ends = [*intervals[size.name], none]
        low, high = max(min(ends), size.low), max(ends) if math.isinf(none) else min(max(ends), size.high)
        ci = [None if math.isinf(end) else end for end in (low, high)]
        found[size.name] = {"unit": case.unit_of(size), "ci": ci}
    return found


def _nats(assessor: Assessor, of: Hypothesis) -> float:
    """Log-likelihood; of what has something unknown integrated out, the evidence."""
    if EVIDENCE in of.extra:
        return float(of.extra[EVIDENCE])
    return assessor.loglik(of)


def _sizes(case: Case, of: Hypothesis, name: str) -> dict[Parameter, float]:
    """The parameters that say how large it is, and where it is none: neutral ones, or a nominal value as believed."""
    switches = {each: each.neutral for each in case.library[name].parameters if each.neutral is not None}
    value = case.library[name].parameters[0]
    return switches or {value: case.replaced.get(name, of.values[name][value.name])}


def _smaller(of: Hypothesis, name: str, sizes: Mapping[Parameter, float]) -> Hypothesis:
    """With the effect nearer to none."""
    values = dict(of.values[name])
    for size, none in sizes.items():
        value = values[size.name]
        values[size.name] = value / LESS if math.isinf(none) else none + LESS * (value - none)
    return replace(of, values={**of.values, name: values})
