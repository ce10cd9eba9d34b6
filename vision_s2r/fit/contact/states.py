"""The states that a recording of poses shows: pose and velocities at each sample, and how sure they are.

A parabola through seven poses, the sample anywhere among them, none of which another point of the body touches the
support than at the others: velocities jump where one does, by ten times what a parabola would show of it.
"""

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.contact import Shape
from vision_s2r.recording import ContactRecording

HALF = 3  # samples to either side
SHAKEN = 3.0  # … and one that is looked at in long stretches, of which none is to be missed by chance
BROKEN = 2.0  # mean squares of the noise: a parabola that misses by more has an impact among its samples
TOUCH = 0.01  # of the body's depth, and three standard deviations of a corner's height: as low as that it touches
LOST = 1e4  # mean squares, of a sample that no seven poses are around
LEAST_NOISE = 2e-4  # of the body's depth, and in rad: poses are not better than that
WORTH = 0.5  # of the uncertainty of a derived velocity: one that was recorded is used where it is as sure as that
LATE = 0.1  # of a sample: by no more than this a recorded velocity may lag


@dataclass(frozen=True)
class States:
    """Of E episodes of T samples; NaN beyond an episode's end."""

    state: np.ndarray  # [E, T, 13] position, attitude, velocity, spin
    sigma: np.ndarray  # [E, T, 4] standard deviations of position, attitude, velocity and spin, of each component
    noise: tuple[float, float]  # m and rad: of one measured pose, each component
    measured: bool  # whether velocities are the recording's own
    clean: np.ndarray  # [E, T] bool: no impact lies among the poses that the velocities are from
    calm: np.ndarray  # [E, T] bool: the poses to either side lie on a parabola, whatever touches


def states_of(recording: ContactRecording, support: float = 0.0) -> States:
    """The states of a recording; `support` is where the body's lowest point rests, m."""
    noise = _noise(recording)
    turns = _relative(recording.attitude)  # [E, T, 4·HALF + 1, 3]
    places = _around(recording.position) - recording.position[:, :, None]
    weights = _stencils(recording.sample_time)
    choice, misfit, clean = _choose(places, turns, weights, noise, _steady(recording, support, noise))
    levels, slopes = _both(places, weights)
    turned, spins = _both(turns, weights)
    level, slope, turn, spin = (
        np.take_along_axis(x, choice[None, ..., None], axis=0)[0] for x in (levels, slopes, turned, spins)
    )
    least = np.take_along_axis(misfit, choice[None], axis=0)[0]
    widened = np.sqrt(np.clip(np.where(np.isfinite(least), least, LOST), 1.0, None))
    gains = np.array([[np.linalg.norm(w[0]), np.linalg.norm(w[1])] for w in weights])[choice]  # [E, T, 2]
    whole = np.isfinite(misfit)
    jump, jolt = (np.where(clean, 0.0, _spread(x, whole)) for x in (slopes, spins))
    sigma = np.stack(
        [
            noise[0] * gains[..., 0] * widened,
            noise[1] * gains[..., 0] * widened,
            np.hypot(noise[0] * gains[..., 1] * widened, jump),
            np.hypot(noise[1] * gains[..., 1] * widened, jolt),
        ],
        axis=-1,
    )
    inside = np.isfinite(recording.position[..., 0])
    attitude = np.full(recording.attitude.shape, np.nan)
    attitude[inside] = (Rotation.from_rotvec(turn[inside]) * Rotation.from_quat(recording.attitude[inside])).as_quat()
    state = np.concatenate([recording.position + level, attitude, slope, spin], axis=-1)
    return _with_velocities(recording, States(state, sigma, noise, False, clean, misfit[HALF] < SHAKEN))


def _with_velocities(recording: ContactRecording, derived: States) -> States:
    """With the recording's velocities where they are surer than what poses say, and do not lag."""
    if recording.velocity is None:
        return derived
    velocity = recording.velocity
    own = [_white(velocity[..., :3]), _white(velocity[..., 3:])]
    smooth = np.isfinite(derived.sigma[..., 2]) & (derived.sigma[..., 2] < 1.01 * np.nanmin(derived.sigma[..., 2]))
    change = np.gradient(derived.state[..., 7:10], recording.sample_time, axis=1)[smooth]
    rest = (velocity[..., :3] - derived.state[..., 7:10])[smooth]
    late = -float((rest * change).sum() / max((change**2).sum(), 1e-300)) / recording.sample_time
    if abs(late) > LATE or any(
        white > WORTH * float(np.nanmin(derived.sigma[..., 2 + k])) for k, white in enumerate(own)
    ):
        return derived
    state, sigma = derived.state.copy(), derived.sigma.copy()
    state[..., :3], state[..., 3:7], state[..., 7:] = recording.position, recording.attitude, velocity
    for k, value in enumerate((*derived.noise, *own)):
        sigma[..., k] = max(value, 1e-6)
    return States(state, sigma, derived.noise, True, np.isfinite(state).all(axis=-1), derived.calm)


def _noise(recording: ContactRecording) -> tuple[float, float]:
    """White noise (m, rad) of a component of the poses."""
    turns = np.diff(_relative(recording.attitude)[:, :, 2 * HALF : 2 * HALF + 2], axis=2)[:, :, 0]
    spin = _white(turns) * np.sqrt(70 / 252)  # of a turn from one sample to the next they are fifth differences
    return (
        max(_white(recording.position), LEAST_NOISE * recording.shape.depth),
        max(float(spin), LEAST_NOISE),
    )


def _white(values: np.ndarray) -> float:
    """Standard deviation of what is white in signals [E, T, 3], by fourth differences: robust against impacts."""
    fourth = np.diff(values, 4, axis=1)
    fourth = np.abs(fourth[np.isfinite(fourth)])
    return float(np.quantile(fourth, 0.4) / 0.5244 / np.sqrt(70)) if len(fourth) else 0.0


def _around(values: np.ndarray) -> np.ndarray:
    """The samples around each [E, T, 4·HALF + 1, …], NaN outside."""
    reach = 2 * HALF
    padded = np.pad(values, ((0, 0), (reach, reach), (0, 0)), constant_values=np.nan)
    return np.stack([padded[:, k : k + values.shape[1]] for k in range(2 * reach + 1)], axis=2)


def _relative(attitude: np.ndarray) -> np.ndarray:
    """Rotation vectors [E, T, 4·HALF + 1, 3] from each attitude to those around it."""
    around = _around(attitude)
    here = np.broadcast_to(attitude[:, :, None], around.shape)
    inside = np.isfinite(around[..., 0]) & np.isfinite(here[..., 0])
    out = np.full((*around.shape[:-1], 3), np.nan)
    out[inside] = (Rotation.from_quat(around[inside]) * Rotation.from_quat(here[inside]).inv()).as_rotvec()
    return out


def _stencils(sample_time: float) -> list[np.ndarray]:
    """Weights [2, 4·HALF + 1] of level and slope, of a parabola through each seven samples around this one."""
    out = []
    for first in range(2 * HALF + 1):
        index = np.arange(first, first + 2 * HALF + 1)
        time = (index - 2 * HALF) * sample_time
        basis = np.stack([np.ones(len(time)), time, time**2], axis=1)
        weights = np.zeros((2, 4 * HALF + 1))
        weights[:, index] = np.linalg.pinv(basis)[:2]
        out.append(weights)
    return out


def _both(around: np.ndarray, weights: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Level and slope [stencils, E, T, 3]."""
    filled = np.nan_to_num(around)
    level, slope = (np.stack([np.einsum("j,etjx->etx", w[k], filled) for w in weights]) for k in (0, 1))
    return level, slope


def _choose(
    places: np.ndarray,
    turns: np.ndarray,
    weights: list[np.ndarray],
    noise: tuple[float, float],
    steady: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which stencil [E, T] to trust, each one's squared misfit [S, E, T] over the noise's, and whether it is clean.

    Of those without an impact the one that says most of the velocity; where all have one, that which misses least.
    """
    index = np.arange(2 * HALF + 1.0)
    basis = np.stack([np.ones(len(index)), index, index**2], axis=1)
    rest = np.eye(len(index)) - basis @ np.linalg.pinv(basis)
    misfit = np.zeros((len(weights), *places.shape[:2]))
    for first in range(len(weights)):
        for around, sigma in ((places, noise[0]), (turns, noise[1])):
            part = around[:, :, first : first + len(index)]
            misfit[first] += (np.einsum("ij,etjx->etix", rest, part) ** 2).sum(axis=(2, 3)) / sigma**2
    misfit /= 6 * (len(index) - 3)
    misfit = np.where(np.isfinite(misfit), misfit, np.inf)
    clean = steady & (misfit < BROKEN)
    cost = np.where(clean, np.array([np.linalg.norm(w[1]) for w in weights])[:, None, None], np.inf)
    some = np.asarray(clean.any(axis=0))
    return np.where(some, np.argmin(cost, axis=0), np.argmin(misfit, axis=0)), misfit, some


def _steady(recording: ContactRecording, support: float, noise: tuple[float, float]) -> np.ndarray:
    """Whether [S, E, T] the same points touch at all samples of a stencil."""
    position = recording.position - np.array([0.0, 0.0, support])
    touch = touching(recording.shape, position, recording.attitude, noise)
    padded = np.pad(changes(touch), ((0, 0), (2 * HALF, 2 * HALF)), mode="edge")
    count = touch.shape[1]
    first = np.stack([padded[:, k : k + count] for k in range(2 * HALF + 1)])
    last = np.stack([padded[:, k + 2 * HALF : k + 2 * HALF + count] for k in range(2 * HALF + 1)])
    return np.asarray(first == last)


def touching(shape: Shape, position: np.ndarray, attitude: np.ndarray, noise: tuple[float, float]) -> np.ndarray:
    """Which points [..., P] of a body are at the support, as far as noise lets one see."""
    touch = TOUCH * shape.depth + 3 * float(np.hypot(noise[0], noise[1] * shape.reach))
    inside = np.isfinite(position[..., 0])
    if len(shape.points):
        heights = np.full((*inside.shape, len(shape.points)), np.nan)
        axes = Rotation.from_quat(attitude[inside]).as_matrix()[:, 2]
        heights[inside] = position[inside][:, 2:] + axes @ shape.points.T
    else:
        heights = shape.lowest(position, attitude)[..., None]
    return np.asarray(heights < touch)


def changes(touch: np.ndarray) -> np.ndarray:
    """How often which points touch [..., T, P] has changed up to a sample [..., T]."""
    changed = (touch[..., 1:, :] != touch[..., :-1, :]).any(axis=-1)
    return np.concatenate([np.zeros_like(touch[..., :1, 0], dtype=int), np.cumsum(changed, axis=-1)], axis=-1)


def _spread(slopes: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Half of what slopes [S, E, T, 3] of whole stencils differ by, a component [E, T]: of an impact's jump."""
    masked = np.where(whole[..., None], slopes, np.nan)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no whole stencil
        spread = (np.nanmax(masked, axis=0) - np.nanmin(masked, axis=0)) / 2
    return np.nan_to_num(np.sqrt((spread**2).mean(axis=-1)))
