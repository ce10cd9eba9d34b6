"""A recording as the search looks at it: short windows that each begin at a measured state.

Motion after impacts is chaotic. A window spans an impact or two, so that what it predicts changes smoothly with every
parameter; what the error of its first state makes of the prediction is known to first order, and counts as noise.
"""

import math
from dataclasses import dataclass
from typing import Any, Self

import numba
import numpy as np

from vision_s2r.contact import NominalContact, Shape
from vision_s2r.fit.contact.bias import bias_of, resting
from vision_s2r.fit.contact.states import States, states_of
from vision_s2r.recording import ContactRecording

SPAN = 0.1  # s, of a window
STRIDE = 0.05  # s, between the starts of two
HORIZONS = 3  # poses of a window that are compared, evenly spaced
LEAST = 6  # samples of a window
MOST_WINDOWS = 700
FLYING, LYING = 3, 8  # of windows in free flight, and of those at rest, one in so many is looked at
NEAR = 0.05  # of the body's depth, and three standard deviations: a lowest point as low as that may be in touch
STILL = 0.02  # m/s: a body that is slower rests
RESTS = 3 * STILL  # of its centre and its rim together: slower throughout, it rests as far as poses show


@dataclass(frozen=True, kw_only=True)
class Starts:
    """W starts in a track, and poses that were measured H times from each on."""

    first: np.ndarray  # [W, 13]
    sigma: np.ndarray  # [W, 4] standard deviations of the first state, as `States` has them
    episode: np.ndarray  # [W] int64
    sample: np.ndarray  # [W] int64, of the start
    measured: np.ndarray  # [W, H, 7] poses

    @classmethod
    def at(cls, track: "ContactTrack", of: np.ndarray, at: np.ndarray, after: np.ndarray, **other: Any) -> Self:
        """At samples `at` [W] of episodes `of` [W], and poses `after` [H] samples of it, the last beyond the end."""
        row = (of[:, None], np.minimum(at[:, None] + after, track.lengths[of][:, None] - 1))
        return cls(
            first=track.states.state[of, at],
            sigma=track.states.sigma[of, at],
            episode=of,
            sample=at,
            measured=np.concatenate([track.position[row], track.attitude[row]], axis=-1),
            **other,
        )

    def some(self, index: np.ndarray) -> Self:
        """Those of this index; steps are common to all."""
        of = {key: value if key == "steps" else value[index] for key, value in vars(self).items()}
        return type(self)(**of)


@dataclass(frozen=True, kw_only=True)
class Windows(Starts):
    """W starts, and what was measured H times after each."""

    steps: np.ndarray  # [H] int64, samples after the start
    inside: np.ndarray  # [W, H] bool: before the end of the episode

    @property
    def samples(self) -> int:
        """That a simulation of a window needs, its first included."""
        return int(self.steps[-1]) + 1


@dataclass(frozen=True)
class ContactTrack:
    """A recording's states, in the frame of its support."""

    nominal: NominalContact
    shape: Shape
    sample_time: float
    states: States
    bias: tuple[float, float]  # m and rad: by how much a toss's poses are off besides their noise
    position: np.ndarray  # [E, T, 3] as measured
    attitude: np.ndarray  # [E, T, 4]
    lengths: np.ndarray  # [E]
    lowest: np.ndarray  # [E, T] m, height of the lowest point
    support: float  # m, where the body's lowest point rests in the recording's frame: taken off all heights

    @property
    def near(self) -> float:
        """Height up to which a lowest point may be in touch."""
        return NEAR * self.shape.depth + 3 * self.states.noise[0]


def make_track(recording: ContactRecording) -> ContactTrack:
    """The track of a recording."""
    states = states_of(recording)
    lowest = recording.shape.lowest(recording.position, recording.attitude)
    speed = np.linalg.norm(states.state[..., 7:10], axis=-1)
    speed += recording.shape.reach * np.linalg.norm(states.state[..., 10:], axis=-1)
    reach = NEAR * recording.shape.depth + 3 * states.noise[0]
    still = speed < STILL + 3 * np.nan_to_num(states.sigma[..., 2])
    rest = still & (np.abs(lowest) < 2 * reach)
    heights = resting(recording.shape, recording.position[rest], recording.attitude[rest])
    support = float(np.median(heights)) if len(heights) > 20 else 0.0
    if support:
        states = states_of(recording, support)
    position = recording.position - np.array([0.0, 0.0, support])
    states.state[..., 2] -= support
    bias = bias_of(recording, still & (np.abs(lowest - support) < reach), states.noise)
    states.sigma[..., :2] = np.hypot(states.sigma[..., :2], bias)
    return ContactTrack(
        nominal=NominalContact(**recording.nominal),
        shape=recording.shape,
        sample_time=recording.sample_time,
        states=states,
        bias=bias,
        position=position,
        attitude=recording.attitude,
        lengths=recording.lengths,
        lowest=lowest - support,
        support=support,
    )


def windows_of(track: ContactTrack, span: float = SPAN, stride: float = STRIDE, thin: bool = True) -> Windows:
    """Windows over all episodes, each begun where its first state is known best, none where an impact hides it.

    With `thin` those in which little happens are fewer.
    """
    length = max(LEAST, round(span / track.sample_time))
    every = max(1, round(stride / track.sample_time))
    steps = np.unique(np.rint(length * np.arange(1, HORIZONS + 1) / HORIZONS).astype(np.int64))
    episode: list[int] = []
    sample: list[int] = []
    for e, samples in enumerate(track.lengths):
        starts = range(0, int(samples) - int(steps[0]), every)
        sure = [_surest(track, e, k, min(k + every, int(samples) - int(steps[0]))) for k in starts]
        kept = [
            k for i, k in enumerate(sure) if track.states.clean[e, k] and (not thin or _kept(track, e, k, length, i))
        ]
        episode += [e] * len(kept)
        sample += kept
    of, at = np.array(episode, dtype=np.int64), np.array(sample, dtype=np.int64)
    if thin and len(of) > MOST_WINDOWS:
        chosen = np.linspace(0, len(of) - 1, MOST_WINDOWS).astype(np.int64)
        of, at = of[chosen], at[chosen]
    return Windows.at(track, of, at, steps, steps=steps, inside=at[:, None] + steps < track.lengths[of][:, None])


def _surest(track: ContactTrack, e: int, first: int, end: int) -> int:
    """The sample from first to end whose velocities are known best."""
    unknown = track.states.sigma[e, first:end, 2] + track.shape.reach * track.states.sigma[e, first:end, 3]
    return first + int(np.argmin(np.nan_to_num(unknown, nan=np.inf)))


def _kept(track: ContactTrack, e: int, k: int, length: int, count: int) -> bool:
    lowest = track.lowest[e, k : k + length + 1]
    if rests(track, track.states.state[e, k : k + length + 1]):
        return count % LYING == 0
    return bool(np.nanmin(lowest) <= track.near) or count % FLYING == 0


def rests(track: ContactTrack, state: np.ndarray) -> bool:
    """Whether a body of these states [T, 13] rests throughout, as far as its poses show."""
    return not moves(track, state).any()


def moves(track: ContactTrack, state: np.ndarray) -> np.ndarray:
    """At which of these states [T, 13] a body moves, as far as its poses show."""
    rim = track.shape.reach * np.linalg.norm(state[:, 10:], axis=1)
    return np.asarray(np.linalg.norm(state[:, 7:10], axis=1) + rim >= RESTS)


def difference(measured: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Measured less predicted poses [..., 6]: m, and rotation vectors in the support's frame."""
    shape = states.shape[:-1]
    measured = np.ascontiguousarray(np.broadcast_to(measured[..., :7], (*shape, 7))).reshape(-1, 7)
    out = np.empty((len(measured), 6))
    _difference(measured, np.ascontiguousarray(states[..., :7]).reshape(-1, 7), out)
    return out.reshape(*shape, 6)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _difference(measured: np.ndarray, predicted: np.ndarray, out: np.ndarray) -> None:
    for n in range(len(out)):
        for axis in range(3):
            out[n, axis] = measured[n, axis] - predicted[n, axis]
        x, y, z, w = measured[n, 3], measured[n, 4], measured[n, 5], measured[n, 6]
        a, b, c, d = -predicted[n, 3], -predicted[n, 4], -predicted[n, 5], predicted[n, 6]
        i, j, k = w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d
        real, size = w * d - x * a - y * b - z * c, math.sqrt(i * i + j * j + k * k)
        angle = 2 * math.atan2(size, abs(real))
        scale = (angle / size if size > 0 else 2.0) * (1.0 if real >= 0 else -1.0)
        out[n, 3], out[n, 4], out[n, 5] = scale * i, scale * j, scale * k
