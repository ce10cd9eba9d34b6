"""How sure parameters are: the sandwich of a fit, episode by episode (Huber, Fifth Berkeley Symposium, 1967)."""

import numpy as np
from scipy.special import stdtrit

from vision_s2r.contact import COEFFICIENTS, CONTACT_EFFECTS
from vision_s2r.fit.case import Hypothesis, Intervals
from vision_s2r.fit.contact.effect import CONTACT_FITS
from vision_s2r.fit.contact.fitter import ContactFitter
from vision_s2r.fit.contact.space import ContactSpace
from vision_s2r.fit.maximum_likelihood import costs

# What another simulator makes of the same parameter, beside noise; standard deviations, from tosses of one.
ALIKE = 2e-3  # of the parameter
COEFFICIENT = 1e-3  # of a friction or a restitution
ANGLE = 5e-5  # rad, of a tilt
POSES = 0.45  # of the error of positions: of a length, since corners and support are only known by poses
ROUGHLY = 0.06  # of a parameter whose effect's form is only roughly the same
FLAT = 1.0  # nats: an end at which the likelihood has fallen by less is farther off …
GONE = 200.0  # … at which it has by more is nearer, however parameters depend on each other
DOUBLINGS = 8  # … by so many doublings, or halvings, at most
AT_BOUND = 0.01  # of the range


def intervals(fitter: ContactFitter, hypothesis: Hypothesis, level: float = 0.95) -> Intervals:
    """Interval of every parameter of the hypothesis' effects."""
    space, point, curvature, slope = fitter.derived(hypothesis)
    out: Intervals = {name: {} for name in space.effects}
    inverse = _inverse(curvature.sum(axis=0) + np.diag(space.prior**-2.0))
    episodes = len(slope)
    inner = np.einsum("ed,ef->df", slope, slope) * episodes / max(episodes - 1, 1)
    noise = np.maximum(np.diag(inverse @ inner @ inverse), np.diag(inverse))
    wide = float(stdtrit(max(episodes - space.size, 2), 0.5 + level / 2))
    ends = _opened(fitter, hypothesis, np.sqrt(noise) * wide, _systematic(fitter, space, point) * wide)
    low, high = (space.machines(end[None])[0] for end in ends)
    for c in space.coordinates:
        out[c.effect][c.parameter] = (float(low[c.column]), float(high[c.column]))
    return out


def _systematic(fitter: ContactFitter, space: ContactSpace, point: np.ndarray) -> np.ndarray:
    """Standard deviation [D] of what is no noise."""
    track = fitter.predictor.track
    off = float(np.hypot(track.states.noise[0], track.bias[0]))
    out, sizes = np.zeros(space.size), space.sizes(point)
    for k, c in enumerate(space.coordinates):
        (unit,) = (each.unit for each in CONTACT_EFFECTS[c.effect].parameters if each.name == c.parameter)
        fit = CONTACT_FITS[c.effect]
        unit = "m" if fit.length else unit
        also = {"m": POSES * off, "rad": ANGLE}.get(unit, COEFFICIENT if c.effect in COEFFICIENTS else 0.0)
        relative = ROUGHLY if fit.rough else ALIKE
        out[k] = np.hypot(also, relative * sizes[k])
    return out


def _opened(
    fitter: ContactFitter, hypothesis: Hypothesis, noise: np.ndarray, systematic: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper ends [D], nearer where the likelihood is gone before, farther off where it hardly falls.

    A ball that slides without rolling bears any larger rolling friction: the slope on this side tells of the other.
    """
    space, point, *_ = fitter.derived(hypothesis)
    data = fitter.data(range(fitter.count))
    best = float(costs(fitter.runs, space, data, point[None])[0][0])
    sides = np.array([[-1.0], [1.0]])

    def rise(ends: np.ndarray, asked: np.ndarray) -> np.ndarray:
        """By how much (nats) the likelihood has fallen at the ends [2, D] that are `asked`; 0 for others."""
        side, k = np.nonzero(asked)
        trial = np.repeat(point[None], len(k), axis=0)
        trial[np.arange(len(k)), k] = np.clip(ends[side, k], space.low[k], space.high[k])
        out = np.zeros(ends.shape)
        if len(k):
            out[side, k] = costs(fitter.runs, space, data, trial)[0] - best
        return out

    asked = np.broadcast_to(np.arange(space.size) < len(space.coordinates), (2, space.size)).copy()
    reach = np.broadcast_to(noise, asked.shape)
    for _ in range(DOUBLINGS):
        asked &= rise(point + sides * reach, asked) > GONE
        reach = np.where(asked, reach / 2, reach)
    ends = point + sides * np.hypot(reach, systematic)
    asked = np.broadcast_to(np.arange(space.size) < len(space.coordinates), ends.shape).copy()
    for _ in range(DOUBLINGS):
        asked &= (rise(ends, asked) < FLAT) & (ends > space.low) & (ends < space.high)
        ends = np.where(asked, point + 2 * (ends - point), ends)
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
    return np.asarray(
        np.linalg.pinv(whole / scale / scale[:, None], rcond=1e-12, hermitian=True) / scale / scale[:, None]
    )
