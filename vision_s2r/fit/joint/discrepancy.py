"""Flexible unknowns: functions that no effect of the library is, so that combinations of effects need not mimic them.

Some are torques over position, velocity or time, which the simulator adds. Some are the drive's gain, or dry friction,
over such a variable, as measured. The others change what goes in or comes out: the command on its way to the motor, the
state on its way to the recording.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from vision_s2r.fit.joint.track import JointScales, JointTrack


@dataclass(frozen=True)
class Discrepancy:
    """One unknown function, linear or nearly so in its coefficients."""

    name: str
    size: int
    scale: float  # of a coefficient that would be plainly visible
    low: np.ndarray
    high: np.ndarray
    prior: np.ndarray
    axis: str | None = None  # of the simulator's tables: position | velocity | time | torque
    knots: tuple[float, float, int] | None = None
    command: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None  # (command, coefficients) -> command
    measured: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None  # (measured, coefficients) -> true state
    shown: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None  # and back, exactly
    load: Callable[[np.ndarray], np.ndarray] | None = None  # coefficients -> torque on the load, [E, 1] or [E, T]
    gain: Callable[[np.ndarray], np.ndarray] | None = None  # coefficients -> factor [E, T] of the drive's torque
    zero: Callable[[np.ndarray], np.ndarray] | None = None  # coefficients -> more position offset, by episode
    step: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "step", np.full(self.size, 0.01 * self.scale))

    @property
    def changes(self) -> bool:
        """Whether it changes what goes into the simulator, or how the sensor shows what comes out."""
        return any((self.command, self.measured, self.load, self.zero, self.gain))


def _table(name: str, axis: str, low: float, high: float, count: int, torque: float) -> Discrepancy:
    bound = np.full(count, 3 * torque)
    return Discrepancy(
        name, count, torque, -bound, bound, np.full(count, 0.5 * torque), axis, (low, max(high, low + 1e-9), count)
    )


def _position(track: JointTrack, scales: JointScales) -> Discrepancy:
    low, high, count = _places(track)
    return _table("torque_of_position", "position", low, high, count, scales.peak_torque)


def _places(track: JointTrack) -> tuple[float, float, int]:
    """Knots over the positions that were reached: eight a turn, 10 to 20."""
    low, high = float(np.nanmin(track.position)), float(np.nanmax(track.position))
    turns = (high - low) / (2 * np.pi) if track.units == "rotary" else 1.0
    return low, high, int(np.clip(8 * turns, 10, 20))


def _velocity(track: JointTrack, scales: JointScales) -> Discrepancy:
    peak = scales.peak_speed
    return _table("torque_of_velocity", "velocity", -peak, peak, 13, scales.peak_torque)


def _time(track: JointTrack, scales: JointScales) -> Discrepancy:
    count = int(np.clip(scales.duration / MOMENT, GAIN_KNOTS, 65))
    return _table("torque_of_time", "time", 0.0, scales.duration, count, scales.peak_torque)


MOMENT = 0.125  # s between knots over time: a disturbance of one or two hertz has some in each period
GAIN_KNOTS = 9
COMMAND_KNOTS = 17  # closer together about 0, where drives are least proportional
STILL = 0.05  # of the usual speed: dry friction turns around within about this


def _gain_over(axis: str) -> Callable[[JointTrack, JointScales], Discrepancy]:
    """The drive's gain as a piecewise-linear function of what is measured."""

    def build(track: JointTrack, scales: JointScales) -> Discrepancy:
        value, knots = _along(axis, track)
        bound, prior = np.full(len(knots), 0.9), np.full(len(knots), 0.15)

        def gain(heights: np.ndarray) -> np.ndarray:
            return 1 + np.interp(value, knots, heights)

        return Discrepancy(f"gain_of_{axis}", len(knots), 0.3, -bound, bound, prior, gain=gain)

    return build


def _friction_over(axis: str) -> Callable[[JointTrack, JointScales], Discrepancy]:
    """Dry friction as a piecewise-linear function of what is measured."""

    def build(track: JointTrack, scales: JointScales) -> Discrepancy:
        value, knots = _along(axis, track)
        against = -np.tanh(np.nan_to_num(track.observed[..., 1]) / (STILL * scales.speed))
        bound, prior = (np.full(len(knots), times * scales.peak_torque) for times in (3, 0.5))

        def load(heights: np.ndarray) -> np.ndarray:
            return against * np.interp(value, knots, heights)

        return Discrepancy(f"friction_of_{axis}", len(knots), scales.peak_torque, -bound, bound, prior, load=load)

    return build


def _along(axis: str, track: JointTrack) -> tuple[np.ndarray, np.ndarray]:
    """What is measured [E, T], and knots over it."""
    value = np.nan_to_num(MEASURED[axis](track))
    low, high, count = _places(track) if axis == "position" else (value.min(), value.max(), GAIN_KNOTS)
    return value, np.linspace(low, max(high, low + 1e-9), count)


MEASURED: dict[str, Callable[[JointTrack], np.ndarray]] = {  # [E, T]
    "position": lambda track: track.position,
    "velocity": lambda track: track.observed[..., 1],
    "time": lambda track: track.time - track.time[:, :1],
    "power": lambda track: np.maximum(track.torque * track.observed[..., 1], 0.0),
}


def _gain(track: JointTrack, scales: JointScales) -> Discrepancy:
    root = np.sqrt(scales.peak_torque)
    return _table("input_nonlinearity", "torque", -root, root, COMMAND_KNOTS, scales.peak_torque)


def _lag(track: JointTrack, scales: JointScales) -> Discrepancy:
    """A first-order lag, exactly averaged over each sample; the coefficient is its time constant in samples."""

    def command(sent: np.ndarray, coefficient: np.ndarray) -> np.ndarray:
        constant = float(coefficient[0])
        if constant < 1e-3:
            return sent
        decay = np.exp(-1 / constant)
        state = lfilter([1 - decay], [1, -decay], sent, axis=1)
        before = np.concatenate([np.zeros((len(sent), 1)), state[:, :-1]], axis=1)
        return sent + (before - sent) * constant * (1 - decay)

    return Discrepancy("drive_lag", 1, 2.0, np.zeros(1), np.full(1, 30.0), np.full(1, np.inf), command=command)


HARMONICS = (1, 2)


def _sensor(track: JointTrack, scales: JointScales) -> Discrepancy:
    """The encoder shows θ + a·sin θ + …; undone about, for what leads the observer."""
    turn = 1.0 if track.units == "rotary" else 2 * np.pi / scales.span
    size = 2 * len(HARMONICS)
    bound = np.full(size, 0.3 / turn)

    def bent(position: np.ndarray, c: np.ndarray) -> np.ndarray:
        terms = (
            c[2 * i] * np.sin(n * turn * position) + c[2 * i + 1] * (np.cos(n * turn * position) - 1)
            for i, n in enumerate(HARMONICS)
        )
        return np.asarray(sum(terms))

    def slope(position: np.ndarray, c: np.ndarray) -> np.ndarray:
        terms = (
            n * turn * (c[2 * i] * np.cos(n * turn * position) - c[2 * i + 1] * np.sin(n * turn * position))
            for i, n in enumerate(HARMONICS)
        )
        return np.asarray(1 + sum(terms))

    def measured(states: np.ndarray, c: np.ndarray) -> np.ndarray:
        shown, position = states[..., 0], states[..., 0]
        for _ in range(3):
            position = shown - bent(position, c)
        return np.stack([position, states[..., 1] / slope(position, c)], axis=-1)

    def shown(states: np.ndarray, c: np.ndarray) -> np.ndarray:
        position = states[..., 0]
        return np.stack([position + bent(position, c), states[..., 1] * slope(position, c)], axis=-1)

    return Discrepancy(
        "sensor_nonlinearity", size, 0.1 / turn, -bound, bound, 0.5 * bound, measured=measured, shown=shown
    )


OWN_BIAS, OWN_OFFSET = "own_bias", "own_position_offset"
# What each of several recordings of a joint has of its own: nobody searches for it, it goes with the effect.
OWN = {"bias_torque": OWN_BIAS, "position_offset": OWN_OFFSET}


def of_episodes(source: np.ndarray, more: np.ndarray) -> np.ndarray:
    """What episodes [E] have more than those of the first recording: `more` [R - 1] is what the later ones have."""
    return np.append(0.0, more)[source]


def _own_bias(track: JointTrack, scales: JointScales) -> Discrepancy:
    source = _source(track)
    bound = np.full(int(source.max()), scales.peak_torque)
    return Discrepancy(
        OWN_BIAS,
        len(bound),
        scales.torque,
        -bound,
        bound,
        0.25 * bound,
        load=lambda more: -of_episodes(source, more)[:, None],
    )


def _own_offset(track: JointTrack, scales: JointScales) -> Discrepancy:
    source = _source(track)
    bound = np.full(int(source.max()), np.pi)
    return Discrepancy(
        OWN_OFFSET, len(bound), 1.0, -bound, bound, bound / np.pi, zero=lambda more: of_episodes(source, more)
    )


def _source(track: JointTrack) -> np.ndarray:
    return np.zeros(len(track.lengths), int) if track.source is None else track.source


DISCREPANCIES: dict[str, Callable[[JointTrack, JointScales], Discrepancy]] = {
    "torque_of_position": _position,
    "torque_of_velocity": _velocity,
    "torque_of_time": _time,
    "input_nonlinearity": _gain,
    "drive_lag": _lag,
    "sensor_nonlinearity": _sensor,
    **{f"gain_of_{axis}": _gain_over(axis) for axis in MEASURED},
    **{f"friction_of_{axis}": _friction_over(axis) for axis in ("position", "time")},
    OWN_BIAS: _own_bias,
    OWN_OFFSET: _own_offset,
}
MEANINGS = {
    "torque_of_position": "a torque that depends on position",
    "torque_of_velocity": "a torque that depends on velocity",
    "torque_of_time": "a torque that depends on the time since the start of an episode",
    "input_nonlinearity": "a drive whose torque is not proportional to the command",
    "drive_lag": "a drive whose torque follows the command with a lag",
    "sensor_nonlinearity": "a sensor that shows positions distorted",
    "gain_of_position": "a drive whose torque depends on position beside the command",
    "gain_of_velocity": "a drive whose torque depends on velocity beside the command",
    "gain_of_time": "a drive whose torque changes with the time since the start of an episode",
    "gain_of_power": "a drive that gives less or more torque the more power it draws",
    "friction_of_position": "a dry friction that depends on position",
    "friction_of_time": "a dry friction that changes with the time since the start of an episode",
}
