"""How well the pictures fix the parameters."""

import numpy as np
from scipy.special import stdtrit

from vision_s2r.camera import CAMERA_EFFECTS
from vision_s2r.fit.case import Intervals, Values
from vision_s2r.fit.unpaired.fitting import UnpairedFitter
from vision_s2r.fit.unpaired.space import chart, of_whole, pack, stepped, to_whole, unpack, wholes

_DRAWS = 500


def intervals(fitter: UnpairedFitter, real: np.ndarray, values: Values, free: np.ndarray) -> Intervals:
    """95 % intervals of every parameter, of statistics `real` [N, K].

    The sandwich of a fit whose weights need not be right: each picture of either set pulls at the parameters, and the
    spread of these pulls is that of the parameters; beside it, what the weights say of the simulator's own tolerance.
    """
    names = sorted(name for name in values if name not in fitter.fixed)
    found = {name: {key: (value, value) for key, value in given.items()} for name, given in values.items()}
    for name in [name for name in names if name in stepped()]:
        found[name] = _steps(fitter, real, values, name, free)
        names.remove(name)
    if not names:
        return found
    columns, small, _ = fitter.slopes(values, names)
    slopes = fitter.rest(columns.T, free).T
    pull = np.linalg.pinv(slopes, rcond=1e-6)
    covariance = pull @ pull.T / fitter.pictures
    spread = np.zeros_like(covariance)
    for pictures, count in ((real, len(real)), (fitter.simulated.statistics(values), fitter.seen)):
        pulls = fitter.rest(pictures - pictures.mean(0), free) @ pull.T
        spread += pulls.T @ pulls / (count * (len(pulls) - 1))
    widest = np.sqrt(np.maximum(np.diag(spread), np.diag(covariance)) / np.diag(covariance))
    covariance *= np.outer(widest, widest)
    freedom = min(len(real), len(fitter.simulated)) - 1
    draws = (
        np.random.default_rng(0).standard_normal((_DRAWS, len(small)))
        @ np.linalg.cholesky(covariance + 1e-12 * np.eye(len(small))).T
        * (stdtrit(freedom, 0.975) / 1.96)
    )
    centre = pack(values, names)
    drawn = [unpack(centre + draw * small, names) for draw in draws]
    for name in names:
        for parameter in CAMERA_EFFECTS[name].parameters:
            at = np.array([each[name][parameter.name] for each in drawn])
            found[name][parameter.name] = _around(
                at, values[name][parameter.name], chart(name).period if parameter.unit == "deg" else None
            )
    return found


def _around(at: np.ndarray, value: float, period: float | None) -> tuple[float, float]:
    """The middle 95 % of draws, which hold the value."""
    if period is not None:
        at = value + (at - value + period / 2) % period - period / 2
    low, high = np.quantile(at, [0.025, 0.975])
    return float(min(low, value)), float(max(high, value))


def _steps(
    fitter: UnpairedFitter, real: np.ndarray, values: Values, name: str, free: np.ndarray
) -> dict[str, tuple[float, float]]:
    """Of an effect that goes by whole numbers: those not less likely by 1.92 nats."""
    target = real.mean(0)
    width = fitter.optics.width
    low, high = wholes(name, width)
    best = to_whole(name, values[name], width)

    def loss(whole: int) -> float:
        return fitter.loss(target - fitter.mean({**values, name: of_whole(name, whole, width)}), free)

    least, ends = loss(best), []
    for sign in (-1, 1):
        end = best
        while low <= end + sign <= high and abs(end - best) < 12 and loss(end + sign) < least + 1.92:
            end += sign
        ends.append(end + 0.5 * sign)
    ((key, value),) = values[name].items()
    inside = sorted(of_whole(name, end, width)[key] for end in ends)
    return {key: (min(inside[0], value), max(inside[1], value))}
