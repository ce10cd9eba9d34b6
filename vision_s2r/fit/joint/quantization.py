"""The steps of an encoder: positions that keep to multiples of a resolution, with or without a little noise on top.

Differences of positions are multiples of the resolution too, so their characteristic function has a peak at one over
it; a fast Fourier transform of their histogram shows all resolutions at once. The positions then settle it.
"""

from dataclasses import dataclass

import numpy as np

LAGS = (1, 2, 5)  # samples between the positions whose differences are looked at
BINS = 1 << 18  # of their histogram
LEAST_CONCENTRATION = 0.35  # mean resultant length of the phases of positions on the grid
LEAST_EVIDENCE = 40.0  # nats
LEAST_SHARE = 0.3  # of the position's fast noise that rounding must account for
PRINTED = 2e-5  # a decimal grid that is finer, relative to the largest position, is how the numbers were written


@dataclass(frozen=True)
class QuantizationGrid:
    """What the positions keep to."""

    resolution: float  # rad or m
    evidence: float  # nats, against positions anywhere between the steps
    noise: float  # standard deviation of what is added after rounding


def find_quantization_grid(position: np.ndarray, lengths: np.ndarray) -> QuantizationGrid | None:
    """The grid of positions [E, T], or None."""
    tracks = [row[:length] for row, length in zip(position, lengths, strict=True)]
    candidates: list[float] = []
    for lag in LAGS:
        steps = np.concatenate([track[lag:] - track[:-lag] for track in tracks if len(track) > lag])
        candidates += _peaks(steps)
    found = [grid for grid in (_settle(tracks, resolution) for resolution in candidates) if grid]
    if not found:
        return None
    most = max(grid.evidence for grid in found)
    return max((each for each in found if each.evidence > 0.5 * most), key=lambda each: each.resolution)


def _peaks(steps: np.ndarray) -> list[float]:
    """Resolutions at which the characteristic function of the steps peaks, the coarsest first."""
    moving = steps[np.abs(steps) > 0]
    if len(moving) < 50:
        return []
    reach = float(np.quantile(np.abs(moving), 0.99))
    inside = moving[np.abs(moving) <= reach]
    width = 2 * reach / (BINS // 16)  # the rest is padding: it refines the frequencies
    histogram = np.bincount(((inside + reach) / width).astype(np.int64), minlength=BINS)[:BINS]
    spectrum = np.abs(np.fft.rfft(histogram)) / len(inside)
    peak = (spectrum[1:-1] >= spectrum[:-2]) & (spectrum[1:-1] > spectrum[2:]) & (spectrum[1:-1] > 0.25)
    at = np.flatnonzero(peak) + 1
    at = at[at * 2 * reach / (BINS * width) > 1.5][:12]
    strong = sorted(at, key=lambda k: -spectrum[k])[:6]
    return [BINS * width / int(k) for k in strong]


def _settle(tracks: list[np.ndarray], resolution: float) -> QuantizationGrid | None:
    """The grid nearest to this resolution, if positions in motion keep to it."""
    moving = [track[_in_motion(track, resolution)] for track in tracks]
    values = np.concatenate(moving)
    if len(values) < 50:
        return None
    reach = max(float(np.abs(values).max()), resolution)
    refined = _refine(tracks, values, resolution)
    phase = np.exp(2j * np.pi * values / refined)
    concentration = float(phase.mean().real)
    if concentration < LEAST_CONCENTRATION or _is_print(refined, reach):
        return None
    noise = refined / (2 * np.pi) * np.sqrt(max(-2 * np.log(min(concentration, 1 - 1e-12)), 0.0))
    evidence = len(values) * concentration**2
    rounding = refined**2 / 12
    fast = _fast_variance(tracks)
    if evidence < LEAST_EVIDENCE or rounding < LEAST_SHARE * fast:
        return None
    return QuantizationGrid(refined, float(evidence), float(noise))


def _refine(tracks: list[np.ndarray], values: np.ndarray, resolution: float) -> float:
    """Least squares of the resolution over longer and longer ways: each settles the number of steps of the next."""
    reach = 4.0  # steps: so many are counted right at the accuracy reached so far
    longest = max(len(track) for track in tracks)
    for lag in 2 ** np.arange(int(np.log2(max(longest - 1, 1))) + 1):
        ways = np.concatenate([track[lag:] - track[:-lag] for track in tracks if len(track) > lag])
        inside = ways[(np.abs(ways) > 0.5 * resolution) & (np.abs(ways) < reach * resolution)]
        if len(inside) >= 20:
            resolution = _polish(inside, resolution)
            reach = max(reach, 2.5 * float(np.abs(inside).max()) / resolution)
    return _polish(values[np.abs(values) < reach * resolution], resolution)


def _polish(values: np.ndarray, resolution: float) -> float:
    counts = np.round(values / resolution)
    power = float(counts @ counts)
    return float(counts @ values) / power if power > 0 else resolution


def _in_motion(track: np.ndarray, resolution: float) -> np.ndarray:
    """Samples around which the position passes several steps, so that its phase would be anywhere without a grid."""
    reach = 5
    if len(track) <= 2 * reach:
        return np.zeros(len(track), dtype=bool)
    way = np.abs(track[2 * reach :] - track[: -2 * reach])
    return np.pad(way > 1.5 * resolution, reach)


def _is_print(resolution: float, reach: float) -> bool:
    decimal = abs(np.log10(resolution) - np.round(np.log10(resolution))) < 1e-4
    return bool(decimal and resolution < PRINTED * reach)


def _fast_variance(tracks: list[np.ndarray]) -> float:
    third = np.concatenate([np.diff(track, 3) for track in tracks])
    return float(np.median(np.abs(third)) / 0.6745) ** 2 / 20
