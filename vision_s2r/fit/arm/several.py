"""Several effects of the whole arm at once: which of all sets, and their values.

Small ones add up: what each does alone ranks all sets by linear least squares. The best are fitted as they are, one
effect after the other beside the rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from vision_s2r.fit.arm.free_run import FreeRuns
from vision_s2r.fit.arm.problems import motions
from vision_s2r.fit.arm.whole import RoughWhole, WholeFit, WholeForm, explained

SETS = 3  # of a size that are fitted
LITTLE = 0.15  # of what is over the noise, that an effect more takes away by linear least squares
GROWN = 2  # of those that a set more grows by, that are fitted
SWEEPS = 2  # over the effects of a set
FAR = 3.0  # times the scale of a number: no effect is expected to be much larger


def fitted_sets(runs: FreeRuns, fits: Mapping[WholeForm, WholeFit], size: int) -> list[RoughWhole]:
    """The likeliest sets of so many of these effects, fitted to what the arm shows without any.

    None where the best leave about what the best of one effect less do.
    """
    forms = list(fits)
    rest = next(iter(fits.values())).without()
    slopes = [fit.slopes() for fit in fits.values()]
    before = float(np.mean(rest**2))

    def left(chosen: tuple[int, ...]) -> tuple[float, np.ndarray]:
        rows = np.concatenate([slopes[k] for k in chosen], axis=1)
        return _linear([forms[k] for k in chosen], rows, rest, before)

    def ranked(size: int) -> list[tuple[float, tuple[int, ...]]]:
        return sorted((left(chosen)[0], chosen) for chosen in combinations(range(len(forms)), size))

    smaller = ranked(size - 1)[0][0]
    likely = [chosen for rest, chosen in ranked(size)[:SETS] if explained(smaller, rest) >= LITTLE]
    found = []
    for chosen in likely:
        some = tuple(forms[k] for k in chosen)
        rough = _begun(some, [np.zeros(len(form.start)) for form in some], left(chosen)[1])
        found.append(refined(runs, rough, before, SWEEPS))
    return found


def grown_sets(runs: FreeRuns, forms: Sequence[WholeForm], best: RoughWhole, before: float) -> list[RoughWhole]:
    """The likeliest sets of one effect more than a fitted one, begun where that is.

    Where one does much of another's work, a mass at a wrong place that of an encoder's zero, what each does about no
    effect at all says little of both.
    """
    moved = motions(runs, best.values)

    def beside(form: WholeForm) -> WholeFit:
        return WholeFit(runs, moved, form, {name: of for name, of in best.values.items() if name != form.name})

    own = np.concatenate([beside(form).slopes(at) for form, at in zip(best.forms, best.points, strict=True)], axis=1)
    found = []
    for form in forms:
        if form in best.forms:
            continue
        fit = beside(form)
        more, rows = (*best.forms, form), np.concatenate([own, fit.slopes()], axis=1)
        left, numbers = _linear(more, rows, fit.without(), best.left)
        found.append((left, _begun(more, [*best.points, np.zeros(len(form.start))], numbers)))
    likely = sorted(found, key=lambda each: each[0])[:GROWN]
    return [refined(runs, rough, before, SWEEPS) for left, rough in likely if explained(best.left, left) >= LITTLE]


def _linear(forms: Sequence[WholeForm], rows: np.ndarray, rest: np.ndarray, before: float) -> tuple[float, np.ndarray]:
    """What is left of residuals [N] by the best steps of the forms' numbers, whose slopes are `rows` [N, K]; and these.

    `before`: the mean square of what is to be explained, at which steps are held to be no larger than is expected.
    """
    expected = FAR * np.concatenate([form.scale for form in forms])
    numbers = -np.linalg.solve(rows.T @ rows + np.diag(before / expected**2), rows.T @ rest)
    return float(np.mean((rest + rows @ numbers) ** 2)), numbers


def _begun(forms: Sequence[WholeForm], points: Sequence[np.ndarray], step: np.ndarray) -> RoughWhole:
    """A set that is still to be fitted, a step [K] of all numbers away from these points, within their bounds."""
    steps = np.split(step, np.cumsum([len(at) for at in points])[:-1])
    there = (np.maximum(at + part, form.low) for form, at, part in zip(forms, points, steps, strict=True))
    return RoughWhole(tuple(forms), tuple(there), 0.0, np.inf)


def refined(runs: FreeRuns, rough: RoughWhole, before: float, sweeps: int = 1) -> RoughWhole:
    """Each effect fitted beside the others, along the motion of such an arm; `before` is left without any of them."""
    for _ in range(sweeps):
        for k, form in enumerate(rough.forms):
            others = {name: each for name, each in rough.values.items() if name != form.name}
            alone = WholeFit(runs, motions(runs, rough.values), form, others).fit(rough.points[k])
            points = (*rough.points[:k], *alone.points, *rough.points[k + 1 :])
            rough = replace(rough, points=points, left=alone.left, share=explained(before, alone.left))
    return rough
