"""A camera with every effect, fitted first: near it the scatter of the statistics is known."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from vision_s2r.camera.colour import Curve
from vision_s2r.fit.camera.effect import Optics, of_stage
from vision_s2r.fit.case import Names, Values
from vision_s2r.fit.least_squares import solved
from vision_s2r.fit.unpaired.fitting import UnpairedFitter
from vision_s2r.fit.unpaired.scatter import scatter, tolerance
from vision_s2r.fit.unpaired.simulated import BASE_NOISE, SimulatedSet
from vision_s2r.fit.unpaired.space import negligible, shown, smooth
from vision_s2r.fit.unpaired.summary import Statistic

_WORTH = 4.0  # nats below which an effect drops out


@dataclass(frozen=True)
class Reference:
    """What all later fits are made with, and the sets of effects that it suggests."""

    fitter: UnpairedFitter
    proposed: list[Names]


def reference(
    real: np.ndarray,
    simulated: SimulatedSet,
    statistics: tuple[Statistic, ...],
    optics: Optics,
    seen: int,
    fixed: Values,
    names: Names,
) -> Reference:
    """From the statistics of the real pictures [N, K] and the effects that may be named.

    `seen` is how many of the simulator's pictures its means are of.
    """
    target = real.mean(0)
    fitter = _fitter(real, simulated, statistics, optics, seen, fixed, {})
    values = _everything(fitter, target, names)
    simulated, values = _with_likelier_curve(fitter, _with_likeliest_noise(fitter, target, values), target, values)
    fitter = _fitter(real, simulated, statistics, optics, seen, fixed, values)
    return Reference(fitter, _eliminated(fitter, target, values))


def _fitter(
    real: np.ndarray,
    simulated: SimulatedSet,
    statistics: tuple[Statistic, ...],
    optics: Optics,
    seen: int,
    fixed: Values,
    values: Values,
) -> UnpairedFitter:
    taken = simulated.statistics(values)
    shift = real.mean(0) - simulated.mean({})
    worth = 1 / (1 / len(real) + 1 / seen)
    base = simulated.base_noise_doubt(values)
    wrong = np.diag(tolerance(statistics, shift)) + np.outer(base, base)
    return UnpairedFitter(simulated, scatter(real, taken, wrong, worth), optics, worth, seen, fixed)


def _with_likeliest_noise(fitter: UnpairedFitter, target: np.ndarray, values: Values) -> SimulatedSet:
    """The simulator's set with the base noise that goes best with a camera."""
    free = np.zeros(len(target), dtype=bool)
    sets = [fitter.simulated.with_base_noise(level) for level in BASE_NOISE]
    losses = [fitter.loss(target - each.mean(values), free) for each in sets]
    return sets[int(np.argmin(losses))]


def _with_likelier_curve(
    fitter: UnpairedFitter, simulated: SimulatedSet, target: np.ndarray, values: dict[str, dict[str, float]]
) -> tuple[SimulatedSet, dict[str, dict[str, float]]]:
    """The set before a camera of sRGB's curve, or of a plain power where that is likelier, and the camera's values.

    A power may need no gamma where sRGB does.
    """
    if simulated.curve != "srgb":
        return simulated, values
    free = np.zeros(len(target), dtype=bool)

    @cache
    def fitted(curve: Curve, names: Names) -> tuple[float, SimulatedSet, dict[str, dict[str, float]]]:
        own = replace(fitter, simulated=simulated.with_curve(curve))
        found = own.fit(target, names, free, {name: values[name] for name in sorted(names)}, 10)
        return own.loss(target - own.mean(found), free), own.simulated, found

    whole = frozenset(values)
    for names in (whole - {"gamma"}, whole):
        loss, power, found = fitted("power", names)
        if loss < min(fitted("srgb", whole)[0], fitted("srgb", names)[0] - _WORTH):
            return power, found
    return simulated, values


def _everything(fitter: UnpairedFitter, target: np.ndarray, names: Names) -> dict[str, dict[str, float]]:
    """All smooth effects, then noise and the likeliest blur where they bring anything."""
    free = np.zeros(len(target), dtype=bool)
    chosen = [name for name in names if smooth(name)]
    values = fitter.fit(target, chosen + list(fitter.fixed), free, {}, 6)
    for rivals in _rivals():
        gains = {name: fitter.gain(target, free, values, name) for name in rivals if name in names}
        best = max(gains, key=lambda name: gains[name], default="")
        if best and gains[best] > _WORTH:
            values = fitter.fit(target, [*values, best], free, values, 3)
    return values


def _rivals() -> list[list[str]]:
    """Noise effects one by one, then the blurs as one group."""
    fits = shown()
    late = sorted((name for name in fits if not smooth(name)), key=lambda name: fits[name].turn)
    return [
        *([name] for name in late if name in of_stage("noise")),
        [name for name in late if name in of_stage("blur")],
    ]


def _eliminated(fitter: UnpairedFitter, target: np.ndarray, values: Values) -> list[Names]:
    """The effects that matter when one by one the least worthy leaves, the others making up for it as far as they can.

    To first order: what an effect does is what losing it alone would change.
    """
    free = np.zeros(len(target), dtype=bool)
    kept = {
        name for name in values if name not in fitter.fixed and not negligible(name, values[name], fitter.optics.width)
    }
    lost, slopes = fitter.effects(values, sorted(kept))

    def loss(names: set[str]) -> float:
        away = sum((lost[name] for name in kept - names), fitter.rest((target - fitter.mean(values))[None], free)[0])
        columns = np.concatenate([slopes[name] for name in sorted(names)] or [np.zeros((len(away), 1))], axis=1)
        left = away - columns @ solved(columns, away, 1e-6)
        return 0.5 * fitter.pictures * float(left @ left)

    names = set(kept)
    while names:
        losses = {name: loss(names - {name}) for name in sorted(names)}
        weakest = min(losses, key=lambda name: losses[name])
        if losses[weakest] > loss(names) + _WORTH:
            break
        names.remove(weakest)
    return [frozenset(names) | frozenset(fitter.fixed)] if names else []
