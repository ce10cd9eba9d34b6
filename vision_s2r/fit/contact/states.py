"""The states that a recording of poses shows: pose and velocities at each sample, and how sure they are.

A parabola through the poses around a sample; where an impact lies among them, through those before or after it alone.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from vision_s2r.recording import ContactRecording

HALF = 3  # samples to either side
BROKEN = 6.0  # mean squares of the noise: a parabola that misses by more has an impact among its samples
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


def states_of(recording: ContactRecording) -> States:
    """The states of a recording."""
    noise = _noise(recording)
    turns = _relative(recording.attitude)  # [E, T, 4·HALF + 1, 3]
    places = _around(recording.position) - recording.position[:, :, None]
    weights = _stencils(recording.sample_time)
    choice, misfit = _choose(places, turns, weights, noise)
    level, slope = (np.take_along_axis(x, choice[None, ..., None], axis=0)[0] for x in _both(places, weights))
    turn, spin = (np.take_along_axis(x, choice[None, ..., None], axis=0)[0] for x in _both(turns, weights))
    widened = np.sqrt(np.maximum(misfit, 1.0))
    gains = np.array([[np.linalg.norm(w[0]), np.linalg.norm(w[1])] for w in weights])[choice]  # [E, T, 2]
    sigma = np.stack(
        [
            noise[0] * gains[..., 0] * widened,
            noise[1] * gains[..., 0] * widened,
            noise[0] * gains[..., 1] * widened,
            noise[1] * gains[..., 1] * widened,
        ],
        axis=-1,
    )
    inside = np.isfinite(recording.position[..., 0])
    attitude = np.full(recording.attitude.shape, np.nan)
    turned = Rotation.from_rotvec(turn[inside]) * Rotation.from_quat(recording.attitude[inside])
    attitude[inside] = turned.as_quat()
    state = np.concatenate([recording.position + level, attitude, slope, spin], axis=-1)
    return _with_velocities(recording, States(state, sigma, noise, False))


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
    return States(state, sigma, derived.noise, True)


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
    """Centred, before and after: [3, 4·HALF + 1] weights of level, slope and misfit's hat (as a parabola's fit)."""
    out = []
    for first in (HALF, 0, 2 * HALF):
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
    places: np.ndarray, turns: np.ndarray, weights: list[np.ndarray], noise: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Which stencil [E, T] to trust, and its mean squared misfit in units of the noise."""
    misfits = []
    for w in weights:
        index = np.flatnonzero(w[0] != 0) if np.count_nonzero(w[0]) > 2 * HALF else np.flatnonzero(w.any(axis=0))
        basis = np.stack([np.ones(len(index)), index - 2.0 * HALF, (index - 2.0 * HALF) ** 2], axis=1)
        rest = np.eye(len(index)) - basis @ np.linalg.pinv(basis)
        total = np.zeros(places.shape[:2])
        for around, sigma in ((places, noise[0]), (turns, noise[1])):
            total += (np.einsum("ij,etjx->etix", rest, around[:, :, index]) ** 2).sum(axis=(2, 3)) / sigma**2
        misfits.append(total / (6 * (len(index) - 3)))
    misfit = np.where(np.isfinite(misfits), misfits, np.inf)
    # A parabola through one side says less of the velocity: only where the centred one is broken.
    choice = np.where(misfit[0] < BROKEN, 0, np.where(misfit[1] < misfit[2], 1, 2))
    chosen = np.take_along_axis(misfit, choice[None], axis=0)[0]
    return choice, np.where(np.isfinite(chosen), chosen, 1e4)
