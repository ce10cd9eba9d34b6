"""The slope of a signal, by local parabolas."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.signal import savgol_filter

EVEN = 1e-6  # relative spread of steps that are one step


def slopes(values: np.ndarray, times: np.ndarray, half: int) -> np.ndarray:
    """Slopes [T] of values [T] at times [T]: of the least-squares parabola over `half` samples to either side.

    At the ends, of the parabola through the first and the last samples, as Savitzky and Golay's filter has it.
    """
    steps = np.diff(times)
    if np.ptp(steps) <= EVEN * steps[0]:
        return np.asarray(savgol_filter(values, 2 * half + 1, 2, deriv=1, delta=float(steps.mean())))
    windows = sliding_window_view(times, 2 * half + 1)
    middle = windows[:, half : half + 1]
    basis = (windows - middle)[..., None] ** np.arange(3)
    curves = (np.linalg.pinv(basis) @ sliding_window_view(values, 2 * half + 1)[..., None])[..., 0]
    centre = np.clip(np.arange(len(values)) - half, 0, len(windows) - 1)
    return np.asarray(curves[centre, 1] + 2 * curves[centre, 2] * (times - middle[centre, 0]))


def episode_slopes(values: np.ndarray, times: np.ndarray, lengths: np.ndarray, half: int) -> np.ndarray:
    """`slopes` [E, T] of each episode, of values and times [E, T]; NaN beyond its end."""
    out = np.full(values.shape, np.nan)
    for k, length in enumerate(lengths):
        out[k, :length] = slopes(values[k, :length], times[k, :length], half)
    return out
