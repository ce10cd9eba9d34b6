"""A recording as the search looks at it: episodes, the states that lead the observer, and segments to hold out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.signal import savgol_filter

from vision_s2r.joint import Nominal
from vision_s2r.recording import JointRecording

LEAK = 1 / 30  # of the observer, a sample
LEAST_UNITS = 5  # fewer episodes than these are cut into stretches …
STRETCHES = 8  # … this many in all
LEAST_STRETCH = 60  # samples
MOST_SAMPLES = 8000  # a longer recording is thinned out, as long as its steps stay below
LONGEST_STEP = 0.005  # s
REST = 4.0  # standard deviations of noise within which a first row is at rest
SMOOTH = (2, 15)  # samples to either side over which velocity is read off positions, at least and at most


@dataclass(frozen=True)
class Scales:
    """How large things are in this recording."""

    torque: float  # rms of the motor torque
    peak_torque: float
    speed: float  # rms
    peak_speed: float
    span: float  # of the position
    duration: float  # s, of the longest episode

    @property
    def damping(self) -> float:
        """A damping that would take up the torque at the usual speed."""
        return self.torque / self.speed

    def top_speed(self, row: Mapping[str, float]) -> float:
        """How fast this machine (its columns by name) would go under its largest torque, if that is not absurd."""
        damping = row["viscous_damping"]
        return min(self.peak_torque / damping, 4 * self.peak_speed) if damping > 0 else 4 * self.peak_speed


@dataclass(frozen=True)
class Track:
    """E episodes of T samples; see the recording for units. Rows beyond an episode's length are NaN, of command 0."""

    nominal: Nominal
    sample_time: float
    units: str  # rotary | linear
    command: np.ndarray  # [E, T]
    position: np.ndarray  # [E, T]
    velocity: np.ndarray | None  # [E, T]; None where it says no more than position does
    observed: np.ndarray  # [E, T, 2]: what the observer is led by; velocity from positions where there is none
    first: np.ndarray  # [E, 2]
    lengths: np.ndarray  # [E] int64
    segment: np.ndarray  # [E, T] int64: stretch or episode that a sample belongs to, -1 beyond the end
    count: int  # of segments

    @cached_property
    def scales(self) -> Scales:
        """Of torque, speed and position."""
        torque = self.nominal.torque_constant * np.concatenate(
            [row[:length] for row, length in zip(self.command, self.lengths, strict=True)]
        )
        speed = self.observed[..., 1]
        return Scales(
            torque=float(np.sqrt(np.mean(torque**2))) or 1e-9,
            peak_torque=float(np.abs(torque).max()) or 1e-9,
            speed=float(np.sqrt(np.nanmean(speed**2))) or 1e-9,
            peak_speed=float(np.nanquantile(np.abs(speed), 0.999)) or 1e-9,
            span=float(np.nanmax(self.position) - np.nanmin(self.position)) or 1e-9,
            duration=float(self.lengths.max()) * self.sample_time,
        )


def make_track(recording: JointRecording, velocity_is_derived: bool) -> Track:
    """The track of a recording; its velocity is left out where it was derived from the encoder's positions."""
    step = _thinning(recording)
    length = -(-recording.lengths // step)
    command = _mean_of_blocks(recording.command, recording.lengths, step)
    position = recording.position[:, ::step]
    velocity = None if recording.velocity is None or velocity_is_derived else recording.velocity[:, ::step]
    sample_time = recording.sample_time * step
    smooth = _smoothed(position, length, sample_time)
    observed = np.stack([position, smooth if velocity is None else velocity], axis=2)
    segment, count = _segments(length, position.shape)
    return Track(
        nominal=Nominal(**recording.nominal),
        sample_time=sample_time,
        units=recording.units,
        command=command,
        position=position,
        velocity=velocity,
        observed=observed,
        first=_first(observed, velocity is None),
        lengths=length,
        segment=segment,
        count=count,
    )


def led_by(track: Track, predicted: np.ndarray) -> Track:
    """The track with velocities read off positions beside an observer's prediction [E, T, 2].

    Only what the prediction lacks is smoothed: what the commands cause at once is in it already.
    """
    rest = track.position - predicted[..., 0]
    velocity = np.full(rest.shape, np.nan)
    half = min(SMOOTH[1], (int(track.lengths.min()) - 1) // 2)
    for row, values, length in zip(velocity, rest, track.lengths, strict=True):
        row[:length] = savgol_filter(values[:length], 2 * half + 1, 2, deriv=1, delta=track.sample_time)
    # The observer's position is pushed at every sample, which is no velocity of its own.
    pushed = LEAK * rest / track.sample_time
    observed = np.stack([track.position, predicted[..., 1] + velocity + pushed], axis=2)
    return replace(track, observed=observed)


def fast_noise(values: np.ndarray) -> float:
    """Standard deviation of what is white in signals [E, T], by third differences; an upper bound for rough motion."""
    third = np.diff(values, 3, axis=1)
    third = third[np.isfinite(third)]
    return float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20)) if len(third) else 0.0


def _thinning(recording: JointRecording) -> int:
    wanted = int(recording.lengths.sum()) // MOST_SAMPLES + 1
    return max(1, min(wanted, int(LONGEST_STEP / recording.sample_time + 1e-6)))


def _mean_of_blocks(command: np.ndarray, lengths: np.ndarray, step: int) -> np.ndarray:
    """The command [E, T] held over `step` samples with the same impulse."""
    if step == 1:
        return command
    episodes, samples = command.shape
    padded = np.zeros((episodes, -(-samples // step) * step))
    padded[:, :samples] = command
    for row, length in zip(padded, lengths, strict=True):
        row[length:] = row[length - 1]
    return padded.reshape(episodes, -1, step).mean(axis=2)


def _smoothed(position: np.ndarray, lengths: np.ndarray, sample_time: float) -> np.ndarray:
    """Velocity [E, T] by local parabolas through positions, over as many samples as their noise asks for."""
    noise = fast_noise(position)
    rough = float(np.nanstd(np.gradient(position, sample_time, axis=1)))
    wanted = (1.5 * (noise / (0.02 * rough * sample_time)) ** 2) ** (1 / 3) if rough > 0 else SMOOTH[1]
    half = int(np.clip(np.ceil(wanted), *SMOOTH))
    half = min(half, (int(lengths.min()) - 1) // 2)
    out = np.full(position.shape, np.nan)
    for row, values, length in zip(out, position, lengths, strict=True):
        row[:length] = savgol_filter(values[:length], 2 * half + 1, 2, deriv=1, delta=sample_time)
    return out


def _first(observed: np.ndarray, no_velocity: bool) -> np.ndarray:
    """First state [E, 2] of each episode: at rest, unless its first rows say that it moves."""
    first = observed[:, 0].copy()
    noise = fast_noise(observed[..., 0 if no_velocity else 1])
    if no_velocity:
        still = np.abs(observed[:, 1, 0] - observed[:, 0, 0]) < REST * np.sqrt(2) * noise
    else:
        still = np.abs(first[:, 1]) < REST * noise
    first[still, 1] = 0.0
    return first


def _segments(lengths: np.ndarray, shape: tuple[int, ...]) -> tuple[np.ndarray, int]:
    episodes = len(lengths)
    pieces = 1 if episodes >= LEAST_UNITS else -(-STRETCHES // episodes)
    segment, count = np.full(shape, -1), 0
    for row, length in zip(segment, lengths, strict=True):
        here = max(1, min(pieces, int(length) // LEAST_STRETCH))
        row[:length] = count + np.arange(length) * here // length
        count += here
    return segment, count
