"""Whether position and velocity can be of one motion: the units of a log are where it is wrong most often.

Velocity is integrated over stretches and set against the way that was gone in them. Over stretches, noise and the
steps of an encoder average out, so a factor between the two is one of units, not of noise. Before that it is set
against the way gone a little earlier: a servo's speed register is often filtered, and its scale is right.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from vision_s2r.errors import UserError
from vision_s2r.recording.data import JointRecording

STRETCHES = 40  # of each episode, at most
LEAST_STRETCH = 5  # samples
PROPORTIONAL, UNRELATED = 0.9, 0.5  # correlations above and below which the two are surely so
TOLERANCE = 1.25  # a factor, either way, that is a matter of calibration
SIGNAL_TO_NOISE = 6.0  # of the way gone in a stretch, below which nothing is said
TURN, NEAR_TURN = 2 * math.pi, 0.7  # rad
# What a velocity may have been written in, in rad/s or m/s: value in SI = written / factor
FACTORS = {
    "rotary": {"degrees?": 180 / math.pi, "rpm?": 30 / math.pi, "turns?": 0.5 / math.pi},
    "linear": {"millimetres?": 1000.0, "centimetres?": 100.0, "inches?": 1 / 0.0254},
}
NEAR_FACTOR = 1.1
WINDOW = 0.04  # s to either side over which velocity and positions are set side by side
LAGGING, SURE = 0.3, 5.0  # samples, and standard errors: this is a lag
FARTHEST, ROUNDS = 0.15, 30  # s that a velocity may be behind the positions


def checked(recording: JointRecording, path: Path) -> JointRecording:
    """The recording, without a velocity that lags behind the positions, or, of a servo, that is not their slope.

    Raises UserError where the position wraps around, or the velocity of another joint is not its derivative.
    """
    if recording.units == "rotary":
        _check_turns(recording, path)
    if recording.velocity is None:
        return recording
    lag = _lag(recording, recording.velocity)
    if lag > LAGGING * recording.sample_time:
        why = f"it lags the positions by {1e3 * lag:.1f} ms, which the simulator's velocity does not"
        return replace(recording, velocity=None, left_out={**recording.left_out, "velocity": why})
    try:
        _check_velocity(recording, path)
    except UserError as error:
        if not recording.servo:  # whose motion is known without it
            raise
        why = str(error).removeprefix(f"{path}: ")
        return replace(recording, velocity=None, left_out={**recording.left_out, "velocity": why})
    return recording


def _lag(recording: JointRecording, velocities: np.ndarray) -> float:
    """By how much (s) the velocity is surely behind the positions; 0 where that cannot be told, or is little.

    Velocity, integrated over a window, is regressed on the way gone in it a while before and on that one's rate of
    change, by which a lag shows however slow the motion is. Both are smoothed alike, so that the noise of positions is
    no lag.
    """
    half = max(1, round(WINDOW / recording.sample_time))
    pieces = [
        _windows(t[:n], position[:n], velocity[:n], half)
        for t, position, velocity, n in zip(
            recording.time, recording.position, velocities, recording.lengths, strict=True
        )
        if n > 12 * half
    ]
    if not pieces:
        return 0.0
    lag, error = 0.0, 0.0
    for _ in range(ROUNDS):
        further, error = _further(pieces, lag, half)
        lag += further
        if not abs(lag) < FARTHEST:
            return 0.0
        if abs(further) < 0.1 * error:
            break
    return lag if lag > max(LAGGING * recording.sample_time, SURE * error) else 0.0


def _windows(
    t: np.ndarray, position: np.ndarray, velocity: np.ndarray, half: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times of windows of `half` samples to either side, the mean slope of the positions in each, and mean velocity."""
    way = np.concatenate([[0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2 * np.diff(t))])
    span = t[2 * half :] - t[: -2 * half]
    slope, shown = ((each[2 * half :] - each[: -2 * half]) / span for each in (position, way))
    return t[half:-half], slope, shown


def _further(pieces: list[tuple[np.ndarray, np.ndarray, np.ndarray]], lag: float, half: int) -> tuple[float, float]:
    """How much more than `lag` the velocities are behind, and that one's standard error (s), over blocks of windows."""
    slopes, bends, velocities, blocks = [], [], [], []
    for number, (t, slope, shown) in enumerate(pieces):
        bend = (slope[2 * half :] - slope[: -2 * half]) / (t[2 * half :] - t[: -2 * half])
        inside = (t - lag >= t[half]) & (t - lag <= t[-half - 1])
        slopes.append(np.interp(t[inside] - lag, t, slope))
        bends.append(np.interp(t[inside] - lag, t[half:-half], bend))
        velocities.append(shown[inside])
        blocks.append(number * 1e6 + np.arange(inside.sum()) // (4 * half))
    slope, bend, shown = np.concatenate(slopes), np.concatenate(bends), np.concatenate(velocities)
    power = float(slope @ slope)
    if power == 0:
        return np.nan, 0.0
    bend = bend - slope * (bend @ slope) / power
    scale = float(shown @ slope) / power
    rest = shown - scale * slope
    reach = scale * float(bend @ bend)
    if reach == 0:
        return np.nan, 0.0
    further = -float(rest @ bend) / reach
    _, block = np.unique(np.concatenate(blocks), return_inverse=True)
    scores = np.bincount(block, (rest + further * scale * bend) * bend)
    return further, float(np.sqrt(scores @ scores)) / abs(reach)


def _check_turns(recording: JointRecording, path: Path) -> None:
    """An encoder that starts again after a turn: one step of a turn between steps that are far smaller."""
    steps = np.diff(recording.position, axis=1)
    with np.errstate(invalid="ignore"):
        small = np.abs(steps) < TURN / 2
        around = np.pad(small[:, :-1], ((0, 0), (1, 0)), constant_values=True) & np.pad(
            small[:, 1:], ((0, 0), (0, 1)), constant_values=True
        )
        jumps = np.argwhere((np.abs(np.abs(steps) - TURN) < NEAR_TURN) & around)
    if len(jumps):
        episode, row = jumps[0]
        raise UserError(
            f"{path}: position jumps by {steps[episode, row]:.3g} rad at t = {recording.time[episode, row]:g} s of "
            f"episode {recording.episodes[episode]}, expected an angle that goes on beyond a turn"
        )


def _check_velocity(recording: JointRecording, path: Path) -> None:
    way, integral, noise = _stretches(recording)
    if len(way) < 3:
        return
    gone, integrated = math.sqrt(np.mean(way**2)), math.sqrt(np.mean(integral**2))
    if max(gone / noise[0], integrated / noise[1]) < SIGNAL_TO_NOISE:
        return  # nothing moves enough to say
    unit = "rad/s" if recording.units == "rotary" else "m/s"
    expected = f"expected the derivative of position, {unit}"
    if min(gone, integrated) < 1e-9 * max(gone, integrated):
        still, moves = ("velocity", "position") if integrated < gone else ("position", "velocity")
        raise UserError(f"{path}: {still} stays at rest while {moves} does not, {expected}")
    correlation = float(np.mean(way * integral)) / (gone * integrated)
    factor = math.copysign(integrated / gone, correlation)
    # Noise on either side lowers the correlation and pulls the factor; then only a gross one is told apart.
    clear = gone > SIGNAL_TO_NOISE * noise[0] and integrated > SIGNAL_TO_NOISE * noise[1]
    if clear and abs(correlation) < UNRELATED:
        raise UserError(f"{path}: velocity does not follow position (correlation {correlation:.2f}), {expected}")
    slack = TOLERANCE if clear else SIGNAL_TO_NOISE
    if abs(correlation) > PROPORTIONAL and not 1 / slack < factor < slack:
        raise UserError(f"{path}: velocity is {factor:.3g} times the derivative of position{_guess(factor, recording)}")


def _stretches(recording: JointRecording) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """The way [K] gone in each stretch by position and by velocity, and the noise (rms) expected of either."""
    assert recording.velocity is not None
    way, integral, lengths = [], [], []
    rows = zip(recording.time, recording.position, recording.velocity, recording.lengths, strict=True)
    for time, position, velocity, length in rows:
        size = max(LEAST_STRETCH, math.ceil((length - 1) / STRETCHES))
        ends = np.arange(0, length, size)
        means = (velocity[1:length] + velocity[: length - 1]) / 2
        travelled = np.concatenate([[0.0], np.cumsum(means * np.diff(time[:length]))])
        way.append(np.diff(position[ends]))
        integral.append(np.diff(travelled[ends]))
        lengths.append(np.full(len(ends) - 1, size))
    size = int(np.mean(np.concatenate(lengths))) if any(map(len, lengths)) else 1
    spread = math.sqrt(2) * _white(recording.position)
    drift = math.sqrt(size) * recording.sample_time * _white(recording.velocity)
    tiny = np.finfo(float).tiny
    return np.concatenate(way), np.concatenate(integral), (spread + tiny, drift + tiny)


def _white(values: np.ndarray) -> float:
    """Standard deviation of what is white in a signal: by its third differences, median over all episodes."""
    third = np.diff(values, n=3, axis=1)
    third = third[np.isfinite(third)]
    return float(np.median(np.abs(third))) / (0.6745 * math.sqrt(20)) if len(third) else 0.0


def _guess(factor: float, recording: JointRecording) -> str:
    if 1 / NEAR_FACTOR < -factor < NEAR_FACTOR:
        return ": is its sign turned round?"
    for name, known in FACTORS[recording.units].items():
        if 1 / NEAR_FACTOR < abs(factor) / known < NEAR_FACTOR:
            return f": velocity in {name}"
        if 1 / NEAR_FACTOR < abs(factor) * known < NEAR_FACTOR:
            return f": position in {name}"
    return f", expected them in one unit and sample_time ({recording.sample_time:g} s) as it was"
