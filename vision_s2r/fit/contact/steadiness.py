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
    """By how much a parameter of this name differs between two halves of the windows: in standard errors, and relative.

    Halves are by time since the start of an episode, by place, by direction, by speed and by spin; the largest
    difference of the parameter that differs least counts, relative to what the effect changes.
    """
    space, *_ = fitter.derived(hypothesis)
    own = space.of(name)
    if not own:
        return 0.0, 0.0
    errors, relative = np.zeros(len(own)), np.zeros(len(own))
    size = _sizes(fitter, hypothesis, name)
    curvature, slope = fitter.by_window(hypothesis)
    for half in _halves(fitter):
        parts = (~half, half)
        info = np.maximum([curvature[part][:, own, own].sum(axis=0) for part in parts], 1e-300)
        step = np.abs(np.subtract(*([slope[part][:, own].sum(axis=0) for part in parts] / info)))
        error = step / np.sqrt((1 / info).sum(axis=0))
        larger = error > errors
        errors, relative = np.where(larger, error, errors), np.where(larger, step / size, relative)
    least = int(np.argmin(errors))
    return float(errors[least]), float(relative[least])


def _sizes(fitter: ContactFitter, hypothesis: Hypothesis, name: str) -> np.ndarray:
    """What an effect changes its parameters [K] by."""
    space, point, *_ = fitter.derived(hypothesis)
    plain = getattr(space.nominal, name) if name in COEFFICIENTS else 0.0
    size = np.array([1.0 if space.coordinates[k].log else abs(point[k] - plain) for k in space.of(name)])
    return np.maximum(np.full(len(size), size.max()), 1e-300)


def _halves(fitter: ContactFitter) -> list[np.ndarray]:
    """Which windows [W] are in the second half; halves of those in which the body may touch."""
    windows, track = fitter.predictor.windows, fitter.predictor.track
    paths = [track.lowest[e, k : k + windows.samples] for e, k in zip(windows.episode, windows.sample, strict=True)]
    touches = np.array([np.nanmin(path) < track.near for path in paths])
    if not touches.any():
        return []
    (x, y, _), (vx, vy, vz), spin = windows.first.T[:3], windows.first.T[7:10], windows.first[:, 10:]
    split = [windows.sample, x, y, np.hypot(vx, vy), vz, (spin**2).sum(axis=1)]
    return [each > np.median(each[touches]) for each in split] + [vx > 0, vy > 0, vx * vy > 0]
