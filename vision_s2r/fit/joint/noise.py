"""How much of a residual is noise: its fast half, what the observer makes of it, how long it remembers."""

from functools import cache, partial

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.track import fast_noise

BLOCK = 32  # samples
TRIMMED = 0.2  # of the blocks, those with the largest fast residual, are left out: impacts and starts are no noise
REPLICAS = 4
MOST_MEMORY = 60  # samples
LEAST = 1e-9  # rad, m, or either per second


def fast_variance(residuals: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Variance [channels] of the white part of residuals [E, T, channels], by second differences, trimmed."""
    out = []
    for channel in range(residuals.shape[-1]):
        powers = []
        for track, length in zip(residuals[..., channel], lengths, strict=True):
            second = np.diff(track[:length], 2) ** 2 / 6
            count = len(second) // BLOCK
            powers.append(second[: count * BLOCK].reshape(count, BLOCK).mean(axis=1))
        power = np.sort(np.concatenate(powers))
        kept = power[: max(1, int(len(power) * (1 - TRIMMED)))]
        out.append(kept.mean() / _trimmed_mean())
    return np.array(out)


def resolved(values: np.ndarray) -> np.ndarray:
    """The least change [channels] from sample to sample in signals [E, T, channels]; LEAST where nothing changes."""
    changes = np.abs(np.diff(values, axis=1)).reshape(-1, values.shape[-1])
    least = np.nanmin(np.where(changes > 0, changes, np.inf), axis=0)
    return np.where(np.isfinite(least), least, LEAST)


def position_noise(position: np.ndarray, simulated: np.ndarray) -> float:
    """Standard deviation (rad, m) of what positions [E, T] do not show: white noise, or an encoder's larger steps.

    At 30 rows a second a motion is as fast as noise; what a simulation [E, T] leaves of it is not.
    """
    white = min(fast_noise(position), fast_noise(position - simulated))
    return float(max(white, resolved(position[..., None])[0] / np.sqrt(12)))


@cache
def _trimmed_mean() -> float:
    """The trimmed mean of the blocks for white noise of variance 1; a simulation of its own, always the same."""
    white = np.random.default_rng(0).normal(size=(4000, BLOCK + 2))
    power = np.sort((np.diff(white, 2, axis=1) ** 2 / 6).mean(axis=1))
    return float(power[: int(len(power) * (1 - TRIMMED))].mean())


def memory(residuals: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Samples [channels] that one independent sample of residuals [E, T, channels] takes: 1 + 2 Σ autocorrelation.

    The sum ends where two neighbouring correlations together fall below zero (Geyer, Statistical Science 7, 1992).
    """
    out = []
    for channel in range(residuals.shape[-1]):
        products = np.zeros(MOST_MEMORY + 1)
        for track, length in zip(residuals[..., channel], lengths, strict=True):
            values = np.clip(track[:length], *np.quantile(track[:length], [0.01, 0.99]))
            for lag in range(min(MOST_MEMORY + 1, length)):
                products[lag] += values[lag:] @ values[: length - lag]
        correlation = products / max(products[0], 1e-300)
        pairs = correlation[0:-1:2] + correlation[1::2]
        end = int(np.argmax(pairs < 0.02)) if (pairs < 0.02).any() else len(pairs)
        out.append(max(1.0, 2 * float(pairs[:end].sum()) - 1))
    return np.array(out)


def inflation(fitter: JointFitter, hypothesis: Hypothesis, noise: np.ndarray) -> np.ndarray:
    """Mean squared residual [channels] over the noise's variance when the machine is right: the leak lets noise in."""
    track, observer = fitter.track, fitter.observer
    space = fitter.space(names_of(hypothesis))
    rows = space.machines(space.start(hypothesis)[None])
    rng = np.random.default_rng(0)
    run = partial(track.inputs.run, rows, track.first, observer.substeps, space.tables)
    truth = run()[0]
    total = np.zeros(observer.channels)
    for _ in range(REPLICAS):
        measured = truth.copy()
        for channel in range(observer.channels):
            measured[..., channel] += rng.normal(0, np.sqrt(noise[channel]), truth.shape[:2])
        led = np.where(track.led[..., None], measured, np.nan)
        seen = run(observed=led, leak=track.leak)[0] if track.leak else truth
        total += np.nanmean((measured - seen)[..., : observer.channels] ** 2, axis=(0, 1))
    return np.maximum(total / REPLICAS / np.maximum(noise, 1e-300), 1.0)
