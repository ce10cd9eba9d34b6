"""Torques that nothing recorded explains: knocks, commands that get lost, a contact that opens.

No function of what is measured is like them, but they are of their own instants. An observer that leaks a thirtieth
remembers each for thirty samples, in which what else there is drowns. Corrected by more of what it was off, it forgets:
what is left at a sample is that sample's. So the unknown torque is integrated out as the noise of the state, by the
steady gain of a Kalman filter (prediction errors: Harvey, Forecasting, Structural Time Series Models and the Kalman
Filter, 1989, section 3.4). Their likelihoods compare under any gain, as each depends on those before it alone.
"""

import numba
import numpy as np

from vision_s2r.fit.joint.track import JointTrack

DISTURBANCE = "disturbance"  # its name; and its key of a hypothesis' extra, which has the gain
GAINS = (0.03, 0.1, 0.25, 0.5, 0.8)  # shares of what the observer was off, by which it is corrected at each sample


def beside(gain: float, residuals: np.ndarray, track: JointTrack) -> np.ndarray:
    """Residuals [..., E, T, channels] beside a disturbance of this gain; as they are where it is 0."""
    if not gain:
        return residuals
    points = residuals.reshape(-1, *residuals.shape[-3:])
    errors = _prediction_errors(points, track.leak, track.sample_time, gain) * (track.segment >= 0)[..., None]
    return np.asarray(errors.reshape(residuals.shape))


@numba.njit(nogil=True, cache=True)
def _prediction_errors(residuals: np.ndarray, leak: float, sample_time: float, gain: float) -> np.ndarray:
    """What residuals [C, E, T, channels] of an observer that leaks would be if it were corrected by this gain, too.

    Of positions alone the velocity is corrected as an alpha-beta filter does (Benedict and Bordner 1962).
    """
    points, episodes, samples, channels = residuals.shape
    out = np.empty_like(residuals)
    rate = gain**2 / (2 - gain) / sample_time
    for c in range(points):
        for e in range(episodes):
            position, velocity = 0.0, 0.0  # of which the correction makes up
            for t in range(samples):
                off = residuals[c, e, t, 0] - position
                out[c, e, t, 0] = off
                position += gain * off
                if channels == 2:
                    turning = residuals[c, e, t, 1] - velocity
                    out[c, e, t, 1] = turning
                    velocity += gain * turning
                else:
                    velocity += rate * off
                position, velocity = (1 - leak) * (position + sample_time * velocity), (1 - leak) * velocity
    return out
