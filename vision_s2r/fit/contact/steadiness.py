"""Whether a parameter is the same wherever one looks, as a true effect's is: in episodes, and in halves of windows."""

import numpy as np

from vision_s2r.contact import COEFFICIENTS
from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.contact.fitter import ContactFitter


def spread(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> float:
    """How much a parameter of this name differs between episodes, relative to what it changes; of its steadiest one."""
    space, _, curvature, slope = fitter.derived(hypothesis)
    own = space.of(name)
    if not own:
        return 0.0
    info = np.maximum(curvature[:, own, own], 1e-300)
    step = slope[:, own] / info
    weight = info / info.sum(axis=0)
    mean = (weight * step).sum(axis=0)
    variance = (weight * ((step - mean) ** 2 - 1 / info)).sum(axis=0)
    size = _sizes(fitter, hypothesis, name)
    return float(np.min(np.sqrt(np.maximum(variance, 0.0)) / size))


def contrast(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> tuple[float, float]:
    """By how much this name's parameters differ between two halves of the windows: in standard errors, and relative.

    Halves are by time since the start of an episode, by place, by direction, by speed and by spin; those count that
    differ most. Several parameters are one vector, relative to what the effect changes it by.
    """
    space, *_ = fitter.derived(hypothesis)
    own = space.of(name)
    if not own:
        return 0.0, 0.0
    size = float(_sizes(fitter, hypothesis, name).max())
    curvature, slope = (each[:, own] for each in fitter.by_row(hypothesis))
    found = [(0.0, 0.0)]
    for half in _halves(fitter):
        spread = [np.linalg.pinv(curvature[part][:, :, own].sum(axis=0)) for part in (~half, half)]
        steps = [each @ slope[part].sum(axis=0) for each, part in zip(spread, (~half, half), strict=True)]
        apart = steps[1] - steps[0]
        error = float(np.sqrt(max(apart @ np.linalg.pinv(spread[0] + spread[1]) @ apart, 0.0)))
        found.append((error, float(np.linalg.norm(apart)) / size))
    return max(found)


def _sizes(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> np.ndarray:
    """What an effect changes its parameters [K] by."""
    space, point, *_ = fitter.derived(hypothesis)
    plain = getattr(space.nominal, name) if name in COEFFICIENTS else 0.0
    size = np.array([1.0 if space.coordinates[k].log else abs(point[k] - plain) for k in space.of(name)])
    return np.maximum(np.full(len(size), size.max()), 1e-300)


def _halves(fitter: ContactFitter) -> list[np.ndarray]:
    """Which rows [R] are in the second half, by their middle; halves of those in which the body may touch."""
    rows, track = fitter.predictor, fitter.predictor.track
    spans = list(zip(rows.episode, rows.sample, rows.samples, strict=True))
    paths = [track.lowest[e, k : k + count] for e, k, count in spans]
    touches = np.array([np.nanmin(path) < track.near for path in paths])
    if not touches.any():
        return []
    middle = np.array([track.states.state[e, min(k + count // 2, track.lengths[e] - 1)] for e, k, count in spans])
    (x, y, _), (vx, vy, vz), spin = middle.T[:3], middle.T[7:10], middle[:, 10:]
    split = [rows.sample + rows.samples // 2, x, y, np.hypot(vx, vy), vz, (spin**2).sum(axis=1)]
    return [each > np.median(each[touches]) for each in split] + [vx > 0, vy > 0, vx * vy > 0]
