"""From a fit of everything to the few effects that it needs: backward, the least missed one at a time."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from vision_s2r.appearance import PICTURE_EFFECTS
from vision_s2r.fit.camera.coordinates import chart, pack
from vision_s2r.fit.camera.effect import Optics, charted
from vision_s2r.fit.camera.fitting import Target, columns, gauss_newton, normal
from vision_s2r.fit.camera.prediction import Stages
from vision_s2r.fit.case import Values

_IDLE = 0.002  # nats a pixel that nobody misses
_NEEDED = 0.4  # … and that everybody does


def chain(target: Target, values: Values, segments: Sequence[int], fixed: Sequence[str]) -> list[tuple[Values, float]]:
    """Ever smaller sets of effects fitted on `segments`, from all of `values` down to one, each with its mean loss."""
    fitted, loss = gauss_newton(target, values, list(values), segments, 2)
    links = [(fitted, loss)]
    while len(names := [name for name in fitted if name not in fixed]) > 1:
        costs = drop_costs(target, fitted, names, segments)
        least = sorted(names, key=lambda name: costs[name])
        idle = [name for name in least[:-1] if costs[name] < _IDLE] or least[:1]
        fitted = {name: value for name, value in fitted.items() if name not in idle}
        fitted, loss = gauss_newton(target, fitted, list(fitted), segments, 3)
        links.append((fitted, loss))
    return links


def without_idle(target: Target, values: Values, segments: Sequence[int], fixed: Collection[str] = ()) -> Values:
    """Without the effects that make no difference."""
    kept, loss = dict(values), target.loss(values, segments)
    for name in [name for name in kept if name not in fixed]:
        if target_loss_without(target, kept, name, segments) < loss + _IDLE / 4:
            del kept[name]
            loss = target.loss(kept, segments)
    return kept


def target_loss_without(target: Target, values: Values, name: str, segments: Sequence[int]) -> float:
    """Mean loss with an effect switched off and the rest as it is."""
    return target.loss({each: value for each, value in values.items() if each != name}, segments)


def drop_costs(target: Target, values: Values, names: Sequence[str], segments: Sequence[int]) -> dict[str, float]:
    """By about how much the mean loss rises when an effect is switched off and the others make up for it."""
    smooth = charted(names)
    stages: Stages = {}
    residual, lit = target.compare(values, segments, stages, keep=True)
    slopes, steps = columns(target, values, smooth, segments, stages, lit)
    matrix = normal(target, slopes, residual, segments).matrix
    here = target.loss(values, segments)
    costs = {}
    at = 0
    for name in names:
        direct = target_loss_without(target, values, name, segments) - here
        if name not in smooth:
            costs[name] = direct
            continue
        size = len(chart(name).steps(target.pictures.optics))
        own = slice(at, at + size)
        at += size
        departure = (pack(values, [name]) - neutral_point(name, values[name], target.pictures.optics)) / steps[own]
        rest = np.r_[0 : own.start, own.stop : len(matrix)]
        stiffness = matrix[own, own]
        if len(rest):
            inner = matrix[np.ix_(rest, rest)] + 1e-9 * np.eye(len(rest)) * matrix.diagonal().max()
            stiffness = stiffness - matrix[own][:, rest] @ np.linalg.solve(inner, matrix[rest][:, own])
        share = (departure @ stiffness @ departure) / max(departure @ matrix[own, own] @ departure, 1e-12)
        # The others make up for so much; what is far from linear is asked for its cost directly.
        costs[name] = direct * float(np.clip(share, 0.0, 1.0))
    return costs


def neutral_point(name: str, values: Mapping[str, float], optics: Optics) -> np.ndarray:
    """The fit's coordinates of an effect that is off but otherwise as it was."""
    neutral = optics.nominal.get(name) or {
        parameter.name: values[parameter.name] if parameter.neutral is None else parameter.neutral
        for parameter in PICTURE_EFFECTS[name].parameters
    }
    return np.array(chart(name).inward(neutral))


def needed(links: Sequence[tuple[Values, float]]) -> list[frozenset[str]]:
    """The sets of a chain that are worth asking: the smallest that is about as good as the best, and those below it."""
    best = min(loss for _, loss in links)
    good = [values for values, loss in links if loss < best + 0.02]
    smallest = min(good, key=len)
    return [frozenset(values) for values, _ in links if len(values) <= len(smallest) + 1]
