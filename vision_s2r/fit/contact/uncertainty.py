"""How sure parameters are: the sandwich of a fit, episode by episode (Huber, Fifth Berkeley Symposium, 1967)."""

import numpy as np
from scipy.stats import t as student

from vision_s2r.contact import COEFFICIENTS
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.contact.fitter import ContactFitter

# For tosses of another simulator: what the sandwich of few episodes misses, and what another integrator makes of the
# same parameter, relative to it.
WIDER, INTEGRATOR = 1.3, 2e-3
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
    plain = np.sqrt(np.maximum(np.diag(inverse @ inner @ inverse), np.diag(inverse)))
    reach = WIDER * plain * float(student.ppf(0.5 + level / 2, max(episodes - space.size, 2)))
    row = space.machines(point[None])[0]
    for k, c in enumerate(space.coordinates):
        value = float(row[c.column])
        if c.log:
            far = float(np.exp(min(reach[k] + INTEGRATOR, 20.0)))
            out[c.effect][c.parameter] = (value / far, value * far)
        else:
            far = float(reach[k] + INTEGRATOR * abs(value))
            out[c.effect][c.parameter] = (value - far, value + far)
    return out


def at_bound(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> bool:
    """Whether a parameter of this name sits at an end of its range at which it vanishes from sight."""
    space, point, *_ = fitter.derived(hypothesis)
    for k, owner in enumerate(space.owner[: len(space.coordinates)]):
        if owner != name:
            continue
        margin = AT_BOUND * (space.high[k] - space.low[k])
        low = point[k] < space.low[k] + margin and (space.coordinates[k].log or name not in COEFFICIENTS)
        if low or point[k] > space.high[k] - margin:
            return True
    return False


def spread(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> float:
    """How much a parameter of this name differs between episodes, relative to what it changes; of its steadiest one."""
    space, point, curvature, slope = fitter.derived(hypothesis)
    own = [k for k, owner in enumerate(space.owner[: len(space.coordinates)]) if owner == name]
    if not own:
        return 0.0
    info = np.maximum(curvature[:, own, own], 1e-300)
    step = slope[:, own] / info
    weight = info / info.sum(axis=0)
    mean = (weight * step).sum(axis=0)
    variance = (weight * ((step - mean) ** 2 - 1 / info)).sum(axis=0)
    plain = getattr(space.nominal, name) if name in COEFFICIENTS else 0.0
    size = np.array([1.0 if space.coordinates[k].log else abs(point[k] - plain) for k in own])
    if len(own) > 1:
        size = np.full(len(own), size.max())
    return float(np.min(np.sqrt(np.maximum(variance, 0.0)) / np.maximum(size, 1e-300)))


def _inverse(whole: np.ndarray) -> np.ndarray:
    scale = np.sqrt(np.diag(whole)) + 1e-300
    return np.asarray(np.linalg.pinv(whole / scale / scale[:, None], rcond=1e-12) / scale / scale[:, None])
