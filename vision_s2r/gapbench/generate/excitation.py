"""What drives a generated joint: open-loop currents of five forms and closed-loop tracking, drawn per episode."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import chirp

from vision_s2r.gapbench.generate.drive import DriveModel, PositionLoop

SAMPLES = 800
SAMPLE_TIME = 0.01  # s
EPISODES = 5


@dataclass(frozen=True)
class Excitation:
    """One episode: its form, what commands it, and where it starts from rest (rad)."""

    form: str
    loop: PositionLoop
    start: float


def draw(nominal: DriveModel, sensor_noise: tuple[float, float], rng: np.random.Generator) -> list[Excitation]:
    """Five episodes of different forms, of amplitudes that move this joint at 1.5 to 9 rad/s at the fastest."""
    from_zero = rng.random() < 0.5
    episodes = []
    for form in rng.permutation(list(FORMS))[:EPISODES]:
        speed = np.exp(rng.uniform(np.log(1.5), np.log(9.0)))
        noise = rng.normal(size=(SAMPLES, 2)) * sensor_noise
        loop = FORMS[form](nominal, speed, noise, rng)
        episodes.append(Excitation(str(form), loop, 0.0 if from_zero else rng.uniform(-0.5, 0.5)))
    return episodes


def played(command: np.ndarray) -> PositionLoop:
    """A loop that plays these currents [T] (A)."""
    nothing = np.zeros((len(command), 2))
    return PositionLoop(np.ascontiguousarray(command), nothing, nothing)


def _amplitude(nominal: DriveModel, speed: float) -> float:
    """Current (A) that keeps the joint at this speed (rad/s), with something to spare for friction and gravity."""
    torque = nominal.viscous_damping * speed + 1.5 * nominal.coulomb_friction + 0.7 * nominal.gravity_torque
    return torque / nominal.torque_constant


def _multisine(nominal: DriveModel, speed: float, noise: np.ndarray, rng: np.random.Generator) -> PositionLoop:
    t = np.arange(SAMPLES) * SAMPLE_TIME
    frequencies = np.exp(rng.uniform(np.log(0.15), np.log(6.0), size=rng.integers(4, 8)))
    phases = rng.uniform(0, 2 * np.pi, size=frequencies.shape)
    command = np.sin(2 * np.pi * frequencies * t[:, None] + phases).sum(1)
    return played(1.5 * _amplitude(nominal, speed) * command / np.abs(command).max())


def _chirp(nominal: DriveModel, speed: float, noise: np.ndarray, rng: np.random.Generator) -> PositionLoop:
    t = np.arange(SAMPLES) * SAMPLE_TIME
    low, high = rng.uniform(0.1, 0.5), rng.uniform(2.0, 8.0)
    command = chirp(t, low, t[-1], high, phi=-90, method=rng.choice(["linear", "logarithmic"]))
    return played(rng.choice([-1.0, 1.0]) * _amplitude(nominal, speed) * command)


def _steps(nominal: DriveModel, speed: float, noise: np.ndarray, rng: np.random.Generator) -> PositionLoop:
    levels = rng.uniform(-1, 1, size=rng.integers(4, 9))
    command = np.repeat(levels, -(-SAMPLES // len(levels)))[:SAMPLES]
    return played(_amplitude(nominal, speed) * command / np.abs(levels).max())


def _triangle(nominal: DriveModel, speed: float, noise: np.ndarray, rng: np.random.Generator) -> PositionLoop:
    t = np.arange(SAMPLES) * SAMPLE_TIME
    phase = t * rng.uniform(0.25, 1.0) + rng.uniform()
    command = 4 * np.abs(phase % 1 - 0.5) - 1
    return played(_amplitude(nominal, speed) * command)


def _telegraph(nominal: DriveModel, speed: float, noise: np.ndarray, rng: np.random.Generator) -> PositionLoop:
    flips = rng.random(SAMPLES) < SAMPLE_TIME / rng.uniform(0.15, 0.6)
    sign = rng.choice([-1.0, 1.0]) * np.where(np.cumsum(flips) % 2 == 0, 1.0, -1.0)
    return played(_amplitude(nominal, speed) * sign)


def _tracking(nominal: DriveModel, speed: float, noise: np.ndarray, rng: np.random.Generator) -> PositionLoop:
    """A PD controller follows two or three sines of this speed."""
    t = np.arange(SAMPLES) * SAMPLE_TIME
    frequencies = rng.uniform(0.2, 1.2, size=rng.integers(2, 4))
    phases = rng.uniform(0, 2 * np.pi, size=frequencies.shape)
    angles = 2 * np.pi * frequencies * t[:, None] + phases
    rate = np.cos(angles).sum(1)
    scale = speed / np.abs(rate).max()
    position = (np.sin(angles) / (2 * np.pi * frequencies)).sum(1)
    reference = scale * np.stack([position - position[0], rate], axis=1)
    bandwidth = rng.uniform(4.0, 12.0)  # rad/s
    per_current = nominal.inertia / nominal.torque_constant
    gain, rate_gain = bandwidth**2 * per_current, rng.uniform(0.7, 1.4) * bandwidth * per_current
    limit = 3 * _amplitude(nominal, speed)
    return PositionLoop(np.zeros(SAMPLES), reference, noise, gain, rate_gain, limit)


FORMS = {
    "multisine": _multisine,
    "chirp": _chirp,
    "steps": _steps,
    "triangle": _triangle,
    "telegraph": _telegraph,
    "tracking": _tracking,
}
