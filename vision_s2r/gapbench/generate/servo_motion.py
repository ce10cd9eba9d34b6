"""What a generated position servo is told: targets of five forms, at time stamps that jitter and skip."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import chirp

SECONDS = 8.0  # of an episode
EPISODES = 5
JITTER, LOST = 0.04, 0.01  # of the sample time, standard deviation; share of rows that are missing
EVEN = 1000  # Hz, from which rows are a clock's own


@dataclass(frozen=True)
class ServoEpisode:
    """One episode: its form, time stamps [T] (s) and targets [T] (rad); it starts at rest at the first of them."""

    form: str
    times: np.ndarray
    targets: np.ndarray


def draw(rate: float, reach: float, bandwidth: float, rng: np.random.Generator) -> list[ServoEpisode]:
    """Episodes of different forms, logged at `rate` (Hz), around 0 by up to `reach` (rad), for such a servo (rad/s)."""
    episodes = []
    for form in rng.permutation(list(_FORMS))[:EPISODES]:
        times = _stamps(rate, rng)
        targets = _FORMS[form](times, bandwidth, rng)
        targets = targets * reach * rng.uniform(0.4, 1.0) / max(np.abs(targets).max(), 1e-9)
        episodes.append(ServoEpisode(str(form), times, targets))
    return episodes


def _stamps(rate: float, rng: np.random.Generator) -> np.ndarray:
    """Time stamps from 0: jittered, some rows missing; those of a fast log are even."""
    count = round(SECONDS * rate)
    if rate >= EVEN:
        return np.arange(count) / rate
    every = np.arange(round(count * (1 + 2 * LOST)) + 10)
    there = np.flatnonzero((rng.random(len(every)) > LOST) | (every == 0))[:count]
    late = np.clip(rng.normal(0.0, JITTER, count), -0.3, 0.3)
    times = (there + late) / rate
    return np.round(times - times[0], 6)  # as they are written


def _multisine(t: np.ndarray, bandwidth: float, rng: np.random.Generator) -> np.ndarray:
    frequencies = np.exp(rng.uniform(np.log(0.1), np.log(bandwidth / 8), size=rng.integers(4, 8)))
    phases = rng.uniform(0, 2 * np.pi, size=frequencies.shape)
    return np.asarray(np.sin(2 * np.pi * frequencies * t[:, None] + phases).sum(1))


def _chirp(t: np.ndarray, bandwidth: float, rng: np.random.Generator) -> np.ndarray:
    low, high = rng.uniform(0.1, 0.4), bandwidth / rng.uniform(8.0, 14.0)
    return np.asarray(rng.choice([-1.0, 1.0]) * chirp(t, low, t[-1], high, phi=-90))


def _steps(t: np.ndarray, bandwidth: float, rng: np.random.Generator) -> np.ndarray:
    held = rng.uniform(0.5, 1.2)
    return rng.uniform(-1, 1, size=int(t[-1] / held) + 2)[(t / held).astype(int)]


def _triangle(t: np.ndarray, bandwidth: float, rng: np.random.Generator) -> np.ndarray:
    phase = t * rng.uniform(0.15, 0.6) + rng.uniform()
    return np.asarray(4 * np.abs(phase % 1 - 0.5) - 1)


def _telegraph(t: np.ndarray, bandwidth: float, rng: np.random.Generator) -> np.ndarray:
    """Steps between two places at random times."""
    flips = rng.exponential(rng.uniform(0.3, 0.8), size=400).cumsum()
    return np.where(np.searchsorted(flips, t) % 2 == 0, 1.0, -1.0)


def _climb(t: np.ndarray, bandwidth: float, rng: np.random.Generator) -> np.ndarray:
    """A sine that rides on a staircase."""
    fast = np.sin(2 * np.pi * rng.uniform(0.5, 1.5) * t)
    return np.asarray(np.floor(4 * np.abs((t / SECONDS + rng.uniform()) % 1 - 0.5) * 4) / 4 - 0.5 + 0.3 * fast)


_FORMS = {
    "multisine": _multisine,
    "chirp": _chirp,
    "steps": _steps,
    "triangle": _triangle,
    "telegraph": _telegraph,
    "climb": _climb,
}
