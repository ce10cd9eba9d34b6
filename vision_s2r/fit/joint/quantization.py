"""The steps of an encoder: positions a whole number of steps from each other, with or without a little noise on top.

Differences of positions are multiples of the resolution, so their characteristic function has a peak at one over it; a
fast Fourier transform of their histogram shows all resolutions at once. The positions then settle it, and where the
steps lie: beside the multiples of the resolution wherever an encoder's zero was put.
"""

from dataclasses import dataclass, replace

import numpy as np

LAGS = (1, 2, 5)  # samples between the positions whose differences are looked at
BINS = 1 << 18  # of their histogram
LEAST_CONCENTRATION = 0.35  # mean resultant length of the phases of positions on the grid
LEAST_EVIDENCE = 40.0  # nats
LEAST_SHARE = 0.3  # of the position's fast noise that rounding must account for, unless they keep to it exactly
EXACT = 1e-3  # of a step: what positions are beside theirs at most, where they keep to it exactly
LEAST_STEPS = 8  # different ones, or moves by one of them, before what they have in common says something
BESIDE = 0.02  # of a step, less than which nothing lies beside the multiples
PRINTED = 2e-5  # a decimal grid that is finer, relative to the largest position, is how the numbers were written


@dataclass(frozen=True)
class QuantizationGrid:
    """What the positions keep to."""

    resolution: float  # rad or m
    offset: float  # of the steps from the multiples of the resolution; half of it either way, about
    evidence: float  # nats, against positions anywhere between the steps
    noise: float  # standard deviation of what is added after rounding
    count: int  # of the positions that say so

    @property
    def values(self) -> dict[str, float]:
        """The parameters of encoder_quantization."""
        return {"resolution": self.resolution, "offset": self.offset}

    def intervals(self, span: float) -> dict[str, tuple[float, float]]:
        """95 % of each, of positions over such a span."""
        spread = 2 * max(self.noise, 1e-6 * self.resolution)
        reaches = {"resolution": self.resolution * max(1e-9, spread / span), "offset": spread / np.sqrt(self.count)}
        return {name: (value - reaches[name], value + reaches[name]) for name, value in self.values.items()}


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
    best = max((each for each in found if each.evidence > 0.5 * most), key=lambda each: each.resolution)
    return _coarsest(tracks, best)


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
    mean = np.exp(2j * np.pi * values / refined).mean()
    concentration = float(np.abs(mean))
    if concentration < LEAST_CONCENTRATION or _is_print(refined, reach):
        return None
    noise = refined / (2 * np.pi) * np.sqrt(max(-2 * np.log(min(concentration, 1 - 1e-12)), 0.0))
    evidence = len(values) * concentration**2
    offset = _beside(float(refined / (2 * np.pi) * np.angle(mean)), refined)
    if abs(offset) < 3 * noise / np.sqrt(len(values)):
        offset = 0.0
    rounding = refined**2 / 12
    fast = _fast_variance(tracks)
    exact = noise < EXACT * refined and not _is_decimal(refined)
    if evidence < LEAST_EVIDENCE or (rounding < LEAST_SHARE * fast and not exact):
        return None
    return QuantizationGrid(refined, offset, float(evidence), float(noise), len(values))


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
    whole = values - np.quantile(values, 0.5, method="nearest")
    near = np.abs(whole) < reach * resolution
    resolution = _polish(whole[near], resolution)
    return _polish_beside(values[near], resolution)


def _polish(values: np.ndarray, resolution: float) -> float:
    counts = np.round(values / resolution)
    power = float(counts @ counts)
    return float(counts @ values) / power if power > 0 else resolution


def _polish_beside(values: np.ndarray, resolution: float) -> float:
    """Least squares of the resolution, and of an offset, over positions whose numbers of steps are known."""
    offset = resolution / (2 * np.pi) * np.angle(np.exp(2j * np.pi * values / resolution).mean())
    counts = np.round((values - offset) / resolution)
    counts -= counts.mean()
    power = float(counts @ counts)
    return float(counts @ values) / power if power > 0 else resolution


def _in_motion(track: np.ndarray, resolution: float) -> np.ndarray:
    """Samples around which the position passes several steps, so that its phase would be anywhere without a grid."""
    reach = 5
    if len(track) <= 2 * reach:
        return np.zeros(len(track), dtype=bool)
    way = np.abs(track[2 * reach :] - track[: -2 * reach])
    return np.pad(way > 1.5 * resolution, reach)


def _coarsest(tracks: list[np.ndarray], grid: QuantizationGrid) -> QuantizationGrid:
    """The coarsest grid that all positions keep to, where they keep to one exactly.

    Where motion is slow, few positions are many steps from the last ones, and a part of the step passes for it.
    """
    lowest = min(float(track.min()) for track in tracks)
    steps = [(track - lowest) / grid.resolution for track in tracks]
    counts = [np.round(each).astype(np.int64) for each in steps]
    if max(np.abs(each - count).max() for each, count in zip(steps, counts, strict=True)) > EXACT:
        return grid
    different = np.unique(np.concatenate(counts))
    common = int(np.gcd.reduce(different))
    moves = sum(int((np.abs(np.diff(each)) == common).sum()) for each in counts)
    if len(different) < LEAST_STEPS and (len(different) < 3 or moves < LEAST_STEPS):
        return grid
    whole = common * grid.resolution
    return replace(grid, resolution=whole, offset=_beside(lowest, whole))


def _beside(position: float, resolution: float) -> float:
    """How far a position is beside a multiple of the resolution; half a step is above it."""
    share = position / resolution - np.floor(position / resolution + 0.5 - BESIDE)
    return float(share * resolution) if abs(share) > BESIDE else 0.0


def _is_print(resolution: float, reach: float) -> bool:
    return _is_decimal(resolution) and resolution < PRINTED * reach


def _is_decimal(resolution: float) -> bool:
    return bool(abs(np.log10(resolution) - np.round(np.log10(resolution))) < 1e-4)


def _fast_variance(tracks: list[np.ndarray]) -> float:
    third = np.concatenate([np.diff(track, 3) for track in tracks])
    return float(np.median(np.abs(third)) / 0.6745) ** 2 / 20
