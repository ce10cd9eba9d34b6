"""The joint written down a second time, from its definitions, for scipy's integrator: slow, and sharing no code."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

SHARP = 1e-4  # rad/s: over which sign(θ̇) is smeared, so that an integrator can follow it

Rates = Callable[[float, np.ndarray, float], np.ndarray]


def sign(velocity: float) -> float:
    return float(np.tanh(velocity / SHARP))


def integrate(rates: Rates, first: np.ndarray, command: np.ndarray, sample_time: float) -> np.ndarray:
    """States [T, S] at the samples; `rates(time, state, current)`, the command held between samples."""
    states = [np.asarray(first, dtype=float)]
    for k, current in enumerate(command[:-1]):
        span = (k * sample_time, (k + 1) * sample_time)
        solved = solve_ivp(rates, span, states[-1], "LSODA", args=(current,), rtol=1e-9, atol=1e-11)
        states.append(solved.y[:, -1])
    return np.array(states)
