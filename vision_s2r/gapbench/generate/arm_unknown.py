"""Effects of an arm outside the vocabulary: torques that nobody taught the diagnosis; the two splits share no kind."""

from collections.abc import Callable

import numpy as np

# (time in s, positions of all joints in rad from where they begin, own velocity in rad/s, torque of the servo in N·m)
# -> N·m beside it
Torque = Callable[[float, np.ndarray, float, float], float]
Family = Callable[[int, int, float, np.random.Generator], Torque]  # joint, of how many, its gain in N·m/rad


def _spring(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """A spring across the joint, as cables are."""
    stiffness, rest = rng.uniform(0.08, 0.25) * gain, rng.uniform(-0.5, 0.5)
    return lambda t, q, v, u: float(-stiffness * (q[joint] - rest))


def _disturbance(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """A machine nearby that shakes it."""
    size, rate, phase = rng.uniform(0.01, 0.04) * gain, rng.uniform(3.0, 12.0), rng.uniform(0, 2 * np.pi)
    return lambda t, q, v, u: float(size * np.sin(rate * t + phase))


def _coupling(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """A belt or a tendon to another joint."""
    stiffness, other = rng.uniform(0.08, 0.25) * gain, (joint + 1) % count
    return lambda t, q, v, u: float(-stiffness * q[other])


def _friction_patch(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """A place at which it rubs."""
    size, place, width = rng.uniform(0.02, 0.06) * gain, rng.uniform(-0.3, 0.3), rng.uniform(0.05, 0.2)
    return lambda t, q, v, u: float(-size * np.tanh(v / 0.02) * np.exp(-(((q[joint] - place) / width) ** 2)))


def _sag(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """A supply that gives way under load."""
    share = rng.uniform(0.2, 0.5) / (0.2 * gain)
    return lambda t, q, v, u: float(-u * min(share * abs(u), 0.8))


def _ripple(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """Magnets and gears: the torque swings as the joint turns."""
    part, waves, phase = rng.uniform(0.2, 0.5), rng.uniform(3, 9), rng.uniform(0, 2 * np.pi)
    return lambda t, q, v, u: float(u * part * np.sin(waves * q[joint] + phase))


def _weak_side(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """Half of the drive's bridge is weaker."""
    lost, side = rng.uniform(0.25, 0.6), rng.choice([-1.0, 1.0])
    return lambda t, q, v, u: float(-lost * u) if u * side > 0 else 0.0


def _stop(joint: int, count: int, gain: float, rng: np.random.Generator) -> Torque:
    """A rubber stop, ahead of where the joint should end."""
    stiffness, at, side = rng.uniform(0.2, 0.6) * gain, rng.uniform(0.1, 0.25), rng.choice([-1.0, 1.0])
    return lambda t, q, v, u: float(-side * stiffness * max(side * q[joint] - at, 0.0))


UNKNOWN: dict[str, dict[str, Family]] = {
    "tuning": {"spring": _spring, "disturbance": _disturbance, "sag": _sag},
    "reporting": {
        "coupling": _coupling,
        "friction_patch": _friction_patch,
        "ripple": _ripple,
        "weak_side": _weak_side,
        "stop": _stop,
    },
}
