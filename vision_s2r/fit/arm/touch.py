"""What an arm's tip touches and its simulator has not: a table, through which the simulated tip goes.

What touches the tip pushes at all joints at once. No effect of a drive or a body does that, so that joints would get
names for it, or none for what they have. A table shows in how far the real tip stays above the simulated one: not at
all down to some height, and below it by all of the way, or by a part where arm and table give way.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from vision_s2r.fit.arm.free_run import heights
from vision_s2r.recording import ArmRecording
from vision_s2r.recording.pieces import Rows, kept_rows

LOWEST, HIGHEST = 0.02, 0.5  # of the rows, that are below what it touches
GIVES_WAY = (0.3, 1.3)  # of the way below it, by which the real tip stays above: 1 of what is rigid
SUSPECTED, SURE = 0.9, 0.6  # of the mean squared error that a parabola over height leaves, at most
CLEARER = 3.0  # times further off is the simulator below than above, root mean square
TIMES = 2  # that it touches, at least
FEWEST = 100  # rows that tell
MARGINS = (0.5, 0.3, 0.1)  # s before and after, in which it may touch already, or give way still: the first of these …
ENOUGH, LEAST = 0.5, 0.25  # … that leaves this part of the rows, or the last; none is left out where less than this is


@dataclass(frozen=True)
class TipTouch:
    """What the tip touches, and when."""

    height: float  # m, of the tip, upwards from the origin of the model
    follows: float  # by this part of the simulated tip's way below it the real one stays above
    above: float  # m: by so much the real tip is above the simulated one then, the median
    rows: Rows  # during which it touches, with a margin
    left_out: Rows  # of these, all, or none where too few others would be left
    share: float  # of all rows
    time: np.ndarray = field(repr=False)  # [E, T] s
    measured: np.ndarray = field(repr=False)  # [E, T] heights (m), NaN after an episode's end
    simulated: np.ndarray = field(repr=False)

    def described(self) -> str:
        """In words."""
        return (
            f"something that the tip touches at a height of {self.height:.2g} m ({len(self.rows)} times; the tip stays "
            f"{1e3 * self.above:.2g} mm above where the simulator has it)"
        )


def suspected(recording: ArmRecording, positions: np.ndarray) -> TipTouch | None:
    """What the tip may touch, of an arm whose simulator [E, T, J] may be wrong in much else."""
    return _found(recording, positions, sure=False)


def touched(recording: ArmRecording, positions: np.ndarray) -> TipTouch | None:
    """What the tip touches, beside simulated positions [E, T, J] that are right but for that."""
    return _found(recording, positions, sure=True)


def _found(recording: ArmRecording, positions: np.ndarray, sure: bool) -> TipTouch | None:
    measured, simulated = heights(recording, recording.position), heights(recording, positions)
    if measured is None or simulated is None:
        return None
    bends = _bends(simulated, measured - simulated, sure)
    at = np.array([bends[k].height if k in bends else -np.inf for k in range(len(simulated))])
    below = simulated < at[:, None]
    rows = _rows(recording, below)
    if len(rows) < TIMES:
        return None
    most = bends[int(np.argmax(below.sum(axis=1)))]
    share = sum(end - first for _, first, end in rows) / int(recording.any.lengths.sum())
    above = float(np.median((measured - simulated)[below]))
    left_out = rows if _kept(recording, rows) >= LEAST else []
    return TipTouch(most.height, most.follows, above, rows, left_out, share, recording.any.time, measured, simulated)


@dataclass(frozen=True)
class _Bend:
    """Below this height (m) the real tip stays above the simulated one, by this part of the way."""

    height: float
    follows: float


def _bends(heights: np.ndarray, off: np.ndarray, sure: bool) -> dict[int, _Bend]:
    """Of each episode [E, T] that has one: the same of all, or, as recordings may be of several tables, its own."""
    if whole := _bend(heights, off, sure):
        return dict.fromkeys(range(len(heights)), whole)
    alone = {k: _bend(*each, sure) for k, each in enumerate(zip(heights, off, strict=True)) if len(heights) > 1}
    return {k: bend for k, bend in alone.items() if bend}


def _bend(heights: np.ndarray, off: np.ndarray, sure: bool) -> _Bend | None:
    """Of simulated heights of the tip, which is really so much higher (NaN: not known)."""
    inside = np.isfinite(heights) & np.isfinite(off)
    height, off = heights[inside], off[inside]
    if len(height) < FEWEST:
        return None
    left, follows, least = _bent(height, off, straight=not sure)
    smooth = _left(np.stack([np.ones_like(height), height, height**2], axis=1), off)[0]
    if not (left <= (SURE if sure else SUSPECTED) * smooth and GIVES_WAY[0] <= follows <= GIVES_WAY[1]):
        return None
    below = height < least
    clear = np.mean(off[below] ** 2) >= CLEARER**2 * np.mean(off[~below] ** 2)
    return _Bend(least, follows) if clear or not sure else None


def _bent(height: np.ndarray, off: np.ndarray, straight: bool) -> tuple[float, float, float]:
    """The best hinge: its mean squared error, its slope, and the height at which it bends.

    Above it the simulator is off by the same everywhere, or, where that is asked for, along a straight line.
    """
    best = (np.inf, 0.0, 0.0)
    terms = [np.ones_like(height), *([height] if straight else [])]
    for least in np.quantile(height, np.linspace(LOWEST, HIGHEST, 49)):
        left, slopes = _left(np.stack([*terms, np.maximum(least - height, 0.0)], axis=1), off)
        best = min(best, (left, float(slopes[-1]), float(least)))
    return best


def _left(terms: np.ndarray, values: np.ndarray) -> tuple[float, np.ndarray]:
    """What least squares leave, the mean square, and their solution."""
    solution = np.linalg.lstsq(terms, values, rcond=None)[0]
    return float(np.mean((values - terms @ solution) ** 2)), solution


def _rows(recording: ArmRecording, below: np.ndarray) -> list[tuple[int, int, int]]:
    """Stretches [E, T] of rows, with as wide a margin as leaves enough others."""
    for seconds in MARGINS:
        rows = list(_with_margin(recording, below, round(seconds / recording.any.sample_time)))
        if _kept(recording, rows) >= ENOUGH:
            break
    return rows


def _kept(recording: ArmRecording, rows: Rows) -> float:
    return kept_rows(recording, rows) / int(recording.any.lengths.sum())


def _with_margin(recording: ArmRecording, below: np.ndarray, margin: int) -> Iterator[tuple[int, int, int]]:
    for k, length in enumerate(recording.any.lengths):
        near = np.convolve(below[k, :length], np.ones(2 * margin + 1), "full")[margin : margin + length] > 0
        edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
        yield from ((k, int(first), int(end)) for first, end in edges.reshape(-1, 2))
