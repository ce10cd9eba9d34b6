"""Motions to be followed: sine sweeps to log a drive under, and tasks for a controller."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vision_s2r.actuator.config import ActuatorTaskConfig, DriveConfig, LogsConfig

SINES = 3  # of a task
SWEEPS = 2  # of a logged motion


@dataclass(frozen=True)
class References:
    """N motions of T samples, known ahead: rad, rad/s, rad/s², [N, T] each, and the payload of each, N·m [N]."""

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    payload: np.ndarray


def sweeps(cfg: LogsConfig, motions: int, sample_time: float, rng: np.random.Generator) -> References:
    """Sums of sine sweeps of random amplitudes and frequencies, as foot trajectories of a leg, and a little noise.

    The noise is in the position alone: it tells the samples of a smooth command apart.
    """
    t = np.arange(round(cfg.seconds / sample_time)) * sample_time
    position = np.zeros((motions, len(t)))
    for _ in range(SWEEPS):
        first, last = (_logarithmic(cfg.frequency, motions, rng) for _ in range(2))
        phase = 2 * np.pi * np.cumsum(first * (last / first) ** (t / t[-1]), axis=1) * sample_time
        phase += rng.uniform(0.0, 2 * np.pi, (motions, 1))
        position += _logarithmic(cfg.amplitude, motions, rng) * np.sin(phase)
    velocity = np.asarray(np.gradient(position, sample_time, axis=1))
    acceleration = np.asarray(np.gradient(velocity, sample_time, axis=1))
    dither = _logarithmic(cfg.dither, motions, rng) * rng.standard_normal(position.shape)
    return References(position + dither, velocity, acceleration, rng.uniform(-cfg.payload, cfg.payload, motions))


def tasks(cfg: ActuatorTaskConfig, motions: int, drive: DriveConfig, rng: np.random.Generator) -> References:
    """Sums of sines of random frequencies, whose accelerations, rather than amplitudes, are of random size.

    What asks more of the nominal drive's motor than `effort` is made smaller.
    """
    t = np.arange(round(cfg.seconds / drive.sample_time)) * drive.sample_time
    position, velocity, acceleration = np.zeros((3, motions, len(t)))
    for _ in range(SINES):
        rate = 2 * np.pi * _logarithmic(cfg.frequency, motions, rng)
        strength = rng.uniform(cfg.acceleration[0], cfg.acceleration[1], (motions, 1))
        amplitude = np.minimum(strength / rate**2, cfg.amplitude)
        phase = rate * t + rng.uniform(0, 2 * np.pi, (motions, 1))
        position += amplitude * np.sin(phase)
        velocity += amplitude * rate * np.cos(phase)
        acceleration -= amplitude * rate**2 * np.sin(phase)
    payload = rng.uniform(-cfg.payload, cfg.payload, motions)
    asked = np.abs(drive.inertia * acceleration + drive.viscous_damping * velocity).max(axis=1)
    left = cfg.effort * drive.torque_limit - drive.coulomb_friction - np.abs(payload)
    share = np.clip(left / asked, 0, 1)[:, None]
    return References(share * position, share * velocity, share * acceleration, payload)


def _logarithmic(ends: Sequence[float], count: int, rng: np.random.Generator) -> np.ndarray:
    return np.exp(rng.uniform(np.log(ends[0]), np.log(ends[1]), (count, 1)))
