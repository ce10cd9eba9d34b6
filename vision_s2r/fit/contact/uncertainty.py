"""How sure parameters are: the sandwich of a fit, episode by episode (Huber, Fifth Berkeley Symposium, 1967)."""

import numpy as np
from scipy.stats import t as student

from vision_s2r.contact import COEFFICIENTS, CONTACT_EFFECTS
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.contact.effect import CONTACT_FITS
from vision_s2r.fit.contact.fitter import ContactFitter
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.maximum_likelihood import costs

# What another simulator makes of the same parameter, beside noise; standard deviations, from tosses of one.
ALIKE = 2e-3  # of the parameter
COEFFICIENT = 1e-3  # of a friction or a restitution
POSES = 0.45  # of the error of positions: of a length, since corners and support are only known by poses
ROUGHLY = 0.06  # of a parameter whose effect's form is only roughly the same
FLAT = 1.0  # nats: an end at which the likelihood has fallen by less is farther off …
DOUBLINGS = 8  # … by so many doublings at most
AT_BOUND = 0.01  # of the range


def intervals(
    fitter: ContactFitter, hypothesis: Hypothesis, level: float = 0.95
) -> dict[str, dict[str, tuple[float, float]]]:
    """Interval of every parameter of the hypothesis' effects."""
    space, point, curvature, slope = fitter.derived(hypothesis)
    out: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in space.effects}
    inverse = _inverse(curvature.sum(axis=0) + np.diag(space.prior**-2.0))
    episodes = len(slope)
    inner = np.einsum("ed,ef->df", slope, slope) * episodes / max(episodes - 1, 1)
    noise = np.maximum(np.diag(inverse @ inner @ inverse), np.diag(inverse))
    deviation = np.sqrt(noise + _systematic(fitter, space, point) ** 2)
    reach = deviation * float(student.ppf(0.5 + level / 2, max(episodes - space.size, 2)))
    ends = _opened(fitter, hypothesis, reach)
    low, high = (space.machines(end[None])[0] for end in ends)
    for c in space.coordinates:
        out[c.effect][c.parameter] = (float(low[c.column]), float(high[c.column]))
    return out


def _systematic(fitter: ContactFitter, space: ContactSpace, point: np.ndarray) -> np.ndarray:
    """Standard deviation [D] of what is no noise."""
    track = fitter.predictor.track
    off = float(np.hypot(track.states.noise[0], track.bias[0]))
    out = np.zeros(space.size)
    for k, c in enumerate(space.coordinates):
        (unit,) = (each.unit for each in CONTACT_EFFECTS[c.effect].parameters if each.name == c.parameter)
        also = POSES * off if unit == "m" else COEFFICIENT if c.effect in COEFFICIENTS else 0.0
        relative = ROUGHLY if CONTACT_FITS[c.effect].rough else ALIKE
        out[k] = np.hypot(also, relative * (1.0 if c.log else abs(point[k])))
    return out


def _opened(fitter: ContactFitter, hypothesis: Hypothesis, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper ends [D], farther off where the likelihood hardly falls on that side.

    A ball that slides without rolling bears any larger rolling friction: the slope on this side tells of the other.
    """
    space, point, *_ = fitter.derived(hypothesis)
    data = fitter.data(range(fitter.count))
    ends = np.stack([point - reach, point + reach])
    best = float(costs(fitter.runs, space, data, point[None])[0][0])
    flat = np.broadcast_to(np.arange(space.size) < len(space.coordinates), ends.shape).copy()
    for _ in range(DOUBLINGS):
        side, k = np.nonzero(flat)
        trial = np.repeat(point[None], len(k), axis=0)
        trial[np.arange(len(k)), k] = np.clip(ends[side, k], space.low[k], space.high[k])
        rise = costs(fitter.runs, space, data, trial)[0] - best
        inside = (ends[side, k] > space.low[k]) & (ends[side, k] < space.high[k])
        flat[side, k] = (rise < FLAT) & inside
        if not flat.any():
            break
        ends = np.where(flat, point + 2 * (ends - point), ends)
    return ends[0], ends[1]


def at_bound(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> bool:
    """Whether a parameter of this name sits at an end of its range at which it vanishes from sight."""
    space, point, *_ = fitter.derived(hypothesis)
    for k in space.of(name):
        margin = AT_BOUND * (space.high[k] - space.low[k])
        low = point[k] < space.low[k] + margin and (space.coordinates[k].log or name not in COEFFICIENTS)
        if low or point[k] > space.high[k] - margin:
            return True
    return False


def _inverse(whole: np.ndarray) -> np.ndarray:
    scale = np.sqrt(np.diag(whole)) + 1e-300
    return np.asarray(np.linalg.pinv(whole / scale / scale[:, None], rcond=1e-12) / scale / scale[:, None])
