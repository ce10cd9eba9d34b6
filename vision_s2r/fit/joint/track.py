"""A recording as the search looks at it: episodes, the states that lead the observer, and segments to hold out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from vision_s2r.fit.joint.slopes import episode_slopes
from vision_s2r.joint import NominalJoint, Tables, simulate
from vision_s2r.joint.simulation import prepared
from vision_s2r.joint.tangent import tangents
from vision_s2r.recording import JointRecording

LEAK = 1 / 30  # of the observer, a sample; a position servo whose drive is on holds its own state, and runs free
LEAST_UNITS = 5  # fewer episodes than these are cut into stretches …
STRETCHES = 8  # … this many in all
LEAST_STRETCH = 60  # samples
MOST_SAMPLES = 8000  # a longer recording is thinned out, as long as its steps stay below
LONGEST_STEP = 0.005  # s
HOLDS = "coulomb_friction"  # all that a joint may show which is only held: it stands still beside its target
HELD = {"rotary": 0.01, "linear": 0.001}  # rad, m, that a joint moves at most where it is only held
REST = 4.0  # standard deviations of noise within which a first row is at rest
SMOOTH = (2, 15)  # samples to either side over which velocity is read off positions, at least and at most


@dataclass(frozen=True)
class JointScales:
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
class EpisodeInputs:
    """What goes into E episodes, at every sample that there was, of which the track may keep fewer."""

    command: np.ndarray  # [E, N]
    sample_time: float
    lengths: np.ndarray  # [E]
    times: np.ndarray | None  # [E, N]
    scale: np.ndarray | None  # [E, N]
    external: np.ndarray | None  # [E, N·S], S values a sample
    load_inertia: np.ndarray | None  # [E, N·S]
    gains: np.ndarray | None  # [E]
    every: int = 1  # samples of a row of the track

    def run(
        self,
        machines: np.ndarray,
        first: np.ndarray,
        substeps: int,
        tables: Tables | None,
        episodes: np.ndarray | slice = slice(None),
        command: np.ndarray | None = None,
        observed: np.ndarray | None = None,
        leak: float = 0.0,
        load: np.ndarray | None = None,
        gain: np.ndarray | None = None,
    ) -> np.ndarray:
        """States [C, E, T, 2] of machines in these episodes, under another command if one is given.

        `load` is a torque on the load beside all others, constant [E, 1] or of each row of the track [E, T]; `gain`
        [E, T] is a factor of the drive's torque.
        """
        given = self._given(episodes, command, observed, leak, load, gain)
        states = simulate(machines, first=first, substeps=substeps, tables=tables, threads=1, **given)
        return states[:, :, :: self.every]

    def tangents(
        self,
        machine: np.ndarray,
        first: np.ndarray,
        substeps: int,
        tables: Tables | None,
        episodes: np.ndarray,
        sizes: tuple[float, float, float],
        drive: np.ndarray,
        load: np.ndarray,
        given: Mapping[str, Any],
    ) -> np.ndarray:
        """How states [E, T, 2, H + G + F] of a machine [P + H] change with torques: see `joint.tangent`.

        `drive` [E, G, T] and `load` [E, F, T] are of rows of the track; `given` is what `run` takes by name.
        """
        inputs = prepared(
            machine[None], first=first, substeps=substeps, tables=tables, **self._given(episodes, **given)
        )
        samples = self.command.shape[1]
        pushes = (_spread(each, samples, self.every) for each in (drive, load))
        return tangents(inputs, sizes, *pushes)[:, :: self.every]

    def _given(
        self,
        episodes: np.ndarray | slice,
        command: np.ndarray | None,
        observed: np.ndarray | None,
        leak: float,
        load: np.ndarray | None,
        gain: np.ndarray | None,
    ) -> dict[str, Any]:
        """What `simulate` takes by name."""
        external = None if self.external is None else self.external[episodes]
        inertia = None if self.load_inertia is None else self.load_inertia[episodes]
        scale = None if self.scale is None else self.scale[episodes]
        if gain is not None:
            more = _spread(gain, self.command.shape[1], self.every)
            scale = more if scale is None else scale * more
        if load is not None:
            like = self.command[episodes] if inertia is None else inertia
            load = load if load.shape[1] == 1 else _spread(load, self.command.shape[1], self.every)
            external = with_load(external, like, load)
        if observed is not None and self.every > 1:
            kept, observed = observed, np.full((*self.command[episodes].shape, 2), np.nan)
            observed[:, :: self.every] = kept
        return {
            "command": self.command[episodes] if command is None else command,
            "sample_time": self.sample_time,
            "times": None if self.times is None else self.times[episodes],
            "scale": scale,
            "external": external,
            "load_inertia": inertia,
            "gains": None if self.gains is None else self.gains[episodes],
            "lengths": self.lengths[episodes],
            "observed": observed,
            "leak": leak,
        }


@dataclass(frozen=True)
class JointTrack:
    """E episodes of T samples; see the recording for units. Rows beyond an episode's length are NaN, of command 0."""

    nominal: NominalJoint
    inputs: EpisodeInputs
    sample_time: float
    time: np.ndarray  # [E, T]
    units: str  # rotary | linear
    command: np.ndarray  # [E, T]
    torque: np.ndarray  # [E, T] of the motor, as the nominal simulator has it
    position: np.ndarray  # [E, T]
    velocity: np.ndarray | None  # [E, T]; None where it says no more than position does
    observed: np.ndarray  # [E, T, 2]: what the observer is led by; velocity from positions where there is none
    first: np.ndarray  # [E, 2]
    lengths: np.ndarray  # [E] int64
    segment: np.ndarray  # [E, T] int64: stretch or episode that a sample belongs to, -1 beyond the end
    count: int  # of segments
    least_inertia: float = 0.0  # that the joint can have
    source: np.ndarray | None = None  # [E]: the recording, of several, that an episode is of

    @property
    def servo(self) -> bool:
        """Whether commands are the targets of a position servo."""
        return self.nominal.proportional_gain is not None

    @cached_property
    def held(self) -> bool:
        """Whether it is a servo whose drive is on, whose target never moves, and which hardly does."""
        pairs = zip(self.inputs.command, self.inputs.lengths, strict=True)
        asked = all(np.ptp(row[:length]) == 0 for row, length in pairs)
        moved = (np.nanmax(self.position, axis=1) - np.nanmin(self.position, axis=1)).max()
        driven = self.inputs.scale is None or bool((self.inputs.scale > 0).all())
        return bool(self.servo and driven and asked and moved <= HELD[self.units])

    @property
    def holding(self) -> float:
        """As much dry friction (N·m, N) holds the joint against its drive and its loads together."""
        load = 0.0 if self.inputs.external is None else float(np.nanmax(np.abs(self.inputs.external)))
        return self.scales.peak_torque + load + abs(self.nominal.gravity_torque) + abs(self.nominal.bias_torque)

    @cached_property
    def led(self) -> np.ndarray:
        """Samples [E, T] at which the observer is led: a servo's while its drive is off and the load swings on."""
        if not self.servo:
            return np.ones(self.position.shape, dtype=bool)
        scale = self.inputs.scale
        return np.zeros(self.position.shape, dtype=bool) if scale is None else scale[:, :: self.inputs.every] <= 0

    @cached_property
    def leak(self) -> float:
        """Of the observer, a sample; 0 where it is never led."""
        return LEAK if self.led.any() else 0.0

    @cached_property
    def scales(self) -> JointScales:
        """Of torque, speed and position."""
        torque = np.concatenate([row[:length] for row, length in zip(self.torque, self.lengths, strict=True)])
        speed = self.observed[..., 1]
        return JointScales(
            torque=float(np.sqrt(np.mean(torque**2))) or 1e-9,
            peak_torque=float(np.abs(torque).max()) or 1e-9,
            speed=float(np.sqrt(np.nanmean(speed**2))) or 1e-9,
            peak_speed=float(np.nanquantile(np.abs(speed), 0.999)) or 1e-9,
            span=float(np.nanmax(self.position) - np.nanmin(self.position)) or 1e-9,
            duration=float(self.lengths.max()) * self.sample_time,
        )


def make_track(recording: JointRecording, velocity_is_derived: bool) -> JointTrack:
    """The track of a recording; its velocity is left out where it was derived from the encoder's positions."""
    step = thinning(recording)
    length = -(-recording.lengths // step)
    command = recording.command[:, ::step]
    if not recording.servo:
        command = _mean_of_blocks(recording.command, recording.lengths, step)
    position = recording.position[:, ::step]
    velocity = None if recording.velocity is None or velocity_is_derived else recording.velocity[:, ::step]
    sample_time = recording.sample_time * step
    time = recording.time[:, ::step]
    smooth = _smoothed(position, length, time)
    observed = np.stack([position, smooth if velocity is None else velocity], axis=2)
    segment, count = _segments(length, position.shape)
    nominal = NominalJoint(**recording.nominal)
    scale = None if recording.supply is None else recording.supply[:, ::step]
    return JointTrack(
        nominal=nominal,
        inputs=_inputs(recording, command, sample_time, length, step),
        sample_time=sample_time,
        time=time,
        units=recording.units,
        command=command,
        torque=_torque(nominal, command, scale, recording.gains, observed),
        position=position,
        velocity=velocity,
        observed=observed,
        first=_first(observed, velocity is None),
        lengths=length,
        segment=segment,
        count=count,
        least_inertia=recording.least_inertia,
        source=recording.source,
    )


def with_load(external: np.ndarray | None, like: np.ndarray, load: np.ndarray) -> np.ndarray:
    """External torques [E, N·S] with `load` [E, 1] or [E, N] more; where there are none, in the shape of `like`."""
    external = np.zeros(like.shape) if external is None else external
    return external + np.repeat(load, external.shape[1] // load.shape[1], axis=1)


def _spread(values: np.ndarray, samples: int, every: int) -> np.ndarray:
    """Values [..., T] of a track's rows as those of all samples [..., N]."""
    return np.repeat(values, every, axis=-1)[..., :samples]


def led_by(track: JointTrack, predicted: np.ndarray) -> JointTrack:
    """The track with velocities read off positions beside an observer's prediction [E, T, 2].

    Only what the prediction lacks is smoothed: what the commands cause at once is in it already.
    """
    rest = track.position - predicted[..., 0]
    half = min(SMOOTH[1], (int(track.lengths.min()) - 1) // 2)
    velocity = episode_slopes(rest, track.time, track.lengths, half)
    # The observer's position is pushed at every sample, which is no velocity of its own.
    pushed = track.leak * rest / track.sample_time
    observed = np.stack([track.position, predicted[..., 1] + velocity + pushed], axis=2)
    return replace(track, observed=observed)


def fast_noise(values: np.ndarray) -> float:
    """Standard deviation of what is white in signals [E, T], by third differences; an upper bound for rough motion."""
    third = np.diff(values, 3, axis=1)
    third = third[np.isfinite(third)]
    return float(np.median(np.abs(third)) / 0.6745 / np.sqrt(20)) if len(third) else 0.0


def _inputs(
    recording: JointRecording, command: np.ndarray, sample_time: float, lengths: np.ndarray, step: int
) -> EpisodeInputs:
    """A servo's targets are held: all of them go in, whichever samples are kept; a torque's mean says as much."""
    if recording.servo:
        whole = recording.command, recording.sample_time, recording.lengths, recording.times
        others = recording.supply, recording.external, recording.load_inertia, recording.gains
        return EpisodeInputs(*whole, *others, every=step)
    supply = None if recording.supply is None else recording.supply[:, ::step]
    loads = (recording.external, recording.load_inertia)
    external, load_inertia = (_parted(each, recording.command.shape[1], step) for each in loads)
    return EpisodeInputs(command, sample_time, lengths, recording.times, supply, external, load_inertia, None)


def _parted(values: np.ndarray | None, samples: int, step: int) -> np.ndarray | None:
    """Values [E, samples·S] as those of samples of `step` of these: each has step·S parts."""
    if values is None:
        return None
    missing = (-samples % step) * (values.shape[1] // samples)
    return np.pad(values, ((0, 0), (0, missing)), mode="edge")


def _torque(
    nominal: NominalJoint,
    command: np.ndarray,
    scale: np.ndarray | None,
    gains: np.ndarray | None,
    observed: np.ndarray,
) -> np.ndarray:
    if nominal.proportional_gain is not None:
        factor = 1.0 if gains is None else gains[:, None]
        command = np.nan_to_num(nominal.asked(command, observed[..., 0], observed[..., 1], factor))
    return nominal.torque_constant * command * (1.0 if scale is None else scale)


def thinning(recording: JointRecording) -> int:
    """How many samples a sample of the track is: long recordings of even samples are thinned out."""
    if recording.times is not None:
        return 1
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


def _smoothed(position: np.ndarray, lengths: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Velocity [E, T] by local parabolas through positions, over as many samples as their noise asks for."""
    noise = fast_noise(position)
    sample_time = float(np.median(np.diff(time, axis=1)))
    rough = float(np.nanstd(np.gradient(position, sample_time, axis=1)))
    wanted = (1.5 * (noise / (0.02 * rough * sample_time)) ** 2) ** (1 / 3) if rough > 0 else SMOOTH[1]
    half = int(np.clip(np.ceil(wanted), *SMOOTH))
    half = min(half, (int(lengths.min()) - 1) // 2)
    return episode_slopes(position, time, lengths, half)


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
