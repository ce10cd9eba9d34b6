"""The gap of a joint: velocity in free run, from each episode's first row to its end, against what was measured.

A position servo's is that of the position: positions are its task, and its speeds are mostly a filtered register.
"""

from itertools import pairwise

import numpy as np
from scipy.signal import savgol_filter

from vision_s2r.fit.case import Axis, Hypothesis, Samples
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.free_run import REACH
from vision_s2r.fit.joint.quantization import QuantizationGrid
from vision_s2r.fit.joint.slopes import slopes

REVERSAL = 0.1  # s to either side of a change of direction
BINS = 5


class FreeRunGap:
    """Squared errors of the velocity, or of a servo's position, sample by sample."""

    def __init__(self, fitter: JointFitter, noise: np.ndarray, grid: QuantizationGrid | None) -> None:
        self._fitter, self._track = fitter, fitter.track
        track = fitter.track
        self._position = track.servo
        self._derived = track.velocity is None and not track.servo
        self._measured = track.position if track.servo else self._velocity(track.position, track.velocity)
        if self._position:
            self.noise_variance = float(noise[0])
        elif self._derived:
            self.noise_variance = float(noise[0]) * _derivative_gain(track.sample_time)
        else:
            self.noise_variance = float(noise[1])
        # Standard deviation that the encoder's steps add to a central difference of positions.
        self._rounding = grid.resolution / np.sqrt(24) / track.sample_time if grid and self._derived else 0.0

    def _squared(self, hypothesis: Hypothesis, states: np.ndarray) -> np.ndarray:
        predicted = self._velocity(states[..., 0], None) if self._derived else states[..., 0 if self._position else 1]
        unpredicted = 0.0 if "encoder_quantization" in hypothesis.values else self._rounding
        return (self._measured - predicted) ** 2 + unpredicted**2

    def samples(self, hypothesis: Hypothesis, stretches: np.ndarray) -> Samples:
        """Errors of the observer's velocity, with the axes of this room; `stretches` [E, T] are taken as exchangeable.

        A free run's errors stay once they are made, far from where they arose.
        """
        track = self._track
        inside = track.segment >= 0
        space = self._fitter.space(names_of(hypothesis))
        squared = self._squared(hypothesis, self._fitter.observer.led(space, space.start(hypothesis)))[inside]
        return Samples(
            error=squared,
            floor=np.full(len(squared), self.noise_variance),
            segment=stretches[inside],
            axes=tuple(Axis(name, labels, bins[inside]) for name, labels, bins in self._axes()),
        )

    def _velocity(self, position: np.ndarray, velocity: np.ndarray | None) -> np.ndarray:
        if velocity is not None:
            return velocity
        out = np.full(position.shape, np.nan)
        for k, (row, values, length) in enumerate(zip(out, position, self._track.lengths, strict=True)):
            row[:length] = slopes(values[:length], self._track.time[k, :length], REACH)
        return out

    def _axes(self) -> list[tuple[str, tuple[str, ...], np.ndarray]]:
        track = self._track
        rotary = track.units == "rotary"
        rate, length, torque_unit = ("rad/s", "rad", "N·m") if rotary else ("m/s", "m", "N")
        speed = np.abs(track.observed[..., 1])
        rest = 0.01 * track.scales.peak_speed + 3 * np.sqrt(self.noise_variance)
        near = _near_reversal(track.observed[..., 1], rest, int(np.ceil(REVERSAL / track.sample_time)))
        torque = np.abs(track.torque)
        sign = np.where(speed < rest, -1, track.observed[..., 1] > 0)
        dot = "θ̇" if rotary else "ẋ"
        return [
            ("reversal", (f"within {REVERSAL:g} s of a reversal", "away from reversals"), np.where(near, 0, 1)),
            ("rest", (f"at rest, |{dot}| < {rest:.2g} {rate}", "in motion"), np.where(speed < rest, 0, 1)),
            ("direction", ("in the negative direction", "in the positive direction"), sign),
            ("velocity", *_quantile_bins(speed, track.segment >= 0, f"|{dot}|", rate)),
            ("torque", *_quantile_bins(torque, track.segment >= 0, "|τ|", torque_unit)),
            ("position", *_even_bins(track.position, "θ" if rotary else "x", length)),
            (
                "time",
                *_even_bins(np.where(track.segment >= 0, track.time, np.nan), "t", "s"),
            ),
        ]


def _derivative_gain(sample_time: float) -> float:
    """Variance of the derivative that white noise of variance 1 leaves."""
    impulse = np.zeros(8 * REACH + 1)
    impulse[4 * REACH] = 1.0
    return float((savgol_filter(impulse, 2 * REACH + 1, 2, deriv=1, delta=sample_time) ** 2).sum())


def _near_reversal(velocity: np.ndarray, rest: float, reach: int) -> np.ndarray:
    """Samples [E, T] within `reach` of one where the direction of motion changes."""
    near = np.zeros(velocity.shape, dtype=bool)
    for row, values in zip(near, velocity, strict=True):
        moving = np.flatnonzero(np.abs(np.nan_to_num(values)) > rest)
        turns = np.flatnonzero(np.diff(np.sign(values[moving])))
        for turn in turns:
            row[max(moving[turn] - reach, 0) : moving[turn + 1] + reach + 1] = True
    return near


def _quantile_bins(
    values: np.ndarray, inside: np.ndarray, symbol: str, unit: str
) -> tuple[tuple[str, ...], np.ndarray]:
    return _bins(values, np.quantile(values[inside], np.linspace(0, 1, BINS + 1)), symbol, unit)


def _even_bins(values: np.ndarray, symbol: str, unit: str) -> tuple[tuple[str, ...], np.ndarray]:
    return _bins(values, np.linspace(np.nanmin(values), np.nanmax(values), BINS + 1), symbol, unit)


def _bins(values: np.ndarray, edges: np.ndarray, symbol: str, unit: str) -> tuple[tuple[str, ...], np.ndarray]:
    edges = np.unique(edges)
    labels = tuple(f"{low:.3g} to {high:.3g} {unit}" for low, high in pairwise(edges))
    labels = tuple(f"{symbol} {label}" for label in labels) or (f"{symbol} {edges[0]:.3g} {unit}",)
    bins = np.clip(np.searchsorted(edges, np.nan_to_num(values), side="right") - 1, 0, len(labels) - 1)
    return labels, np.where(np.isnan(values), -1, bins)
