"""The gap of a joint: velocity in free run, from each episode's first row to its end, against what was measured.

A position servo's is that of the position: positions are its task, and its speeds are mostly a filtered register.
"""

from itertools import pairwise

import numpy as np
from scipy.signal import savgol_filter

from vision_s2r.fit.bins import by_rank, evenly
from vision_s2r.fit.case import Axis, Hypothesis, Samples
from vision_s2r.fit.joint.effect import JOINT_FITS
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.free_run import REACH
from vision_s2r.fit.joint.quantization import QuantizationGrid
from vision_s2r.fit.joint.slopes import episode_slopes, slopes
from vision_s2r.fit.joint.track import JointTrack, fast_noise

REVERSAL = 0.1  # s to either side of a change of direction
THROUGH = 0.05  # s after a change of the sign of the acceleration: play is gone through, as the load goes on by itself
BINS, ENDS = 5, "{low:.3g} to {high:.3g}"


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

    def moved(self, hypothesis: Hypothesis, name: str, stretches: np.ndarray) -> Samples:
        """How far an effect of the hypothesis moves the velocity within one sample, along the axes of its definition.

        Squared, with no noise in it: each sample begins where the joint was measured, with the effect and without.
        """
        inside = self._track.segment >= 0
        change = self._ahead(hypothesis) - self._ahead(hypothesis.without(name))
        axes = {each: (labels, bins) for each, labels, bins in self._axes()}
        if period := JOINT_FITS[name].period:
            again = period(hypothesis.values[name])
            axes["position"] = _within_period(self._track.position, again, self._track.units)
        return Samples(
            error=np.nan_to_num(change[inside] ** 2),
            floor=np.zeros(int(inside.sum())),
            segment=stretches[inside],
            axes=tuple(Axis(each, axes[each][0], axes[each][1][inside]) for each in JOINT_FITS[name].along),
        )

    def _ahead(self, hypothesis: Hypothesis) -> np.ndarray:
        space = self._fitter.space(names_of(hypothesis))
        return self._fitter.observer.ahead(space, space.start(hypothesis))[..., 1]

    def _velocity(self, position: np.ndarray, velocity: np.ndarray | None) -> np.ndarray:
        if velocity is not None:
            return velocity
        return episode_slopes(position, self._track.time, self._track.lengths, REACH)

    def _axes(self) -> list[tuple[str, tuple[str, ...], np.ndarray]]:
        track, inside = self._track, self._track.segment >= 0
        rotary = track.units == "rotary"
        rate, length, torque_unit = ("rad/s", "rad", "N·m") if rotary else ("m/s", "m", "N")
        speed = np.abs(track.observed[..., 1])
        rest = 0.01 * track.scales.peak_speed + 3 * np.sqrt(self.noise_variance)
        reach, through = (int(np.ceil(each / track.sample_time)) for each in (REVERSAL, THROUGH))
        near = _near_change(track.observed[..., 1], rest, reach, reach)
        acceleration = _acceleration(track)
        still = 3 * fast_noise(track.observed[..., 1]) * np.sqrt(_derivative_gain(track.sample_time))
        after = _near_change(acceleration, still, 0, through)
        torque = np.abs(track.torque)
        sign = np.where(speed < rest, -1, track.observed[..., 1] > 0)
        dot = "θ̇" if rotary else "ẋ"
        return [
            ("reversal", (f"within {REVERSAL:g} s of a reversal", "away from reversals"), np.where(near, 0, 1)),
            ("rest", (f"at rest, |{dot}| < {rest:.2g} {rate}", "in motion"), np.where(speed < rest, 0, 1)),
            (
                "acceleration",
                (f"within {THROUGH:g} s after a change of the sign of the acceleration", "away from these changes"),
                np.where(after, 0, 1),
            ),
            ("direction", ("in the negative direction", "in the positive direction"), sign),
            ("velocity", *by_rank(np.where(inside, speed, np.nan), BINS, f"|{dot}| {ENDS} {rate}")),
            ("torque", *by_rank(np.where(inside, torque, np.nan), BINS, f"|τ| {ENDS} {torque_unit}")),
            ("position", *evenly(track.position, BINS, f"{'θ' if rotary else 'x'} {ENDS} {length}")),
            ("time", *evenly(np.where(inside, track.time, np.nan), BINS, f"t {ENDS} s")),
        ]


def _derivative_gain(sample_time: float) -> float:
    """Variance of the derivative that white noise of variance 1 leaves."""
    impulse = np.zeros(8 * REACH + 1)
    impulse[4 * REACH] = 1.0
    return float((savgol_filter(impulse, 2 * REACH + 1, 2, deriv=1, delta=sample_time) ** 2).sum())


def _acceleration(track: JointTrack) -> np.ndarray:
    """[E, T]; NaN beyond an episode's end."""
    out = np.full(track.position.shape, np.nan)
    for row, speed, time, length in zip(out, track.observed[..., 1], track.time, track.lengths, strict=True):
        if length > 2 * REACH:
            row[:length] = slopes(speed[:length], time[:length], REACH)
    return out


def _near_change(values: np.ndarray, least: float, before: int, after: int) -> np.ndarray:
    """Samples [E, T] next to one where values [E, T] change their sign; those smaller than `least` have none."""
    near = np.zeros(values.shape, dtype=bool)
    for row, each in zip(near, values, strict=True):
        plain = np.flatnonzero(np.abs(np.nan_to_num(each)) > least)
        for turn in np.flatnonzero(np.diff(np.sign(each[plain]))):
            row[max(plain[turn] - before, 0) : plain[turn + 1] + after + 1] = True
    return near


def _within_period(position: np.ndarray, period: float, units: str) -> tuple[tuple[str, ...], np.ndarray]:
    """Distances from where a torque that is a sine of this period is largest, either way."""
    symbol, unit = ("θ", "rad") if units == "rotary" else ("x", "m")
    half = 0.5 * period  # between two of these places
    away = np.abs(np.mod(np.nan_to_num(position) / half, 1.0) - 0.5) * 2
    edges = np.linspace(0, 0.5 * half, BINS + 1)
    labels = tuple(
        f"{low:.2g} to {high:.2g} {unit} from {symbol} = {0.5 * half:.3g} + k·{half:.3g} {unit}"
        for low, high in pairwise(edges)
    )
    return labels, np.where(np.isnan(position), -1, (away * BINS).astype(int).clip(0, BINS - 1))
