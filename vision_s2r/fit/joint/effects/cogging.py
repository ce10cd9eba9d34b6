"""How cogging is fitted: its teeth are read off a periodogram over position."""

import math

import numpy as np
from scipy.signal import cont2discrete, lfilter, ss2tf

from vision_s2r.fit.coordinates import ParameterRange, Setting, linear, log
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit, Row
from vision_s2r.fit.joint.track import LEAK, JointTrack

TEETH = 12  # of a turn, or of the travel: a plausible motor
PROPOSED = 4  # numbers of teeth proposed
MOST_TEETH = 400  # numbers tried


def ranges(track: JointTrack, noise: float) -> list[ParameterRange]:
    """What the fit moves. Of a sine at least a period is seen: less of it is any smooth torque of position."""
    s = track.scales
    return [
        linear("amplitude", 0.0, 2 * s.peak_torque, s.torque),
        log("teeth", min(max(0.5, 2 * math.pi / s.span), 1e4), 1e5, 1e-3 / max(1.0, s.span)),
    ]


def starts(track: JointTrack, row: Row, residuals: np.ndarray) -> list[Setting]:
    """Which sine of position, through the observer, is most like the residual: a periodogram."""
    slowest = 2 * math.pi / track.scales.span
    fastest = min(0.6 * math.pi / (track.scales.speed * track.sample_time), MOST_TEETH * slowest)
    teeth = np.arange(max(slowest, 0.5), max(fastest, 2 * slowest), 0.4 * slowest)
    response = _observer_response(
        np.sin(teeth[:, None, None] * np.nan_to_num(track.position)), track, row, residuals.shape[-1]
    )
    seen = residuals[..., -1]
    power = np.einsum("net,net->n", response, response) + 1e-300
    amplitude = np.einsum("net,et->n", response, seen) / power
    gain = np.where(amplitude > 0, amplitude**2 * power, 0.0)
    best: list[int] = []
    for k in np.argsort(-gain):
        if all(abs(k - other) > 2 for other in best):
            best.append(int(k))
        if len(best) == PROPOSED:
            break
    return [{"amplitude": float(max(amplitude[k], 1e-3 * track.scales.torque)), "teeth": float(teeth[k])} for k in best]


def plausible(track: JointTrack, row: Row) -> Setting:
    """A size that an engineer would care about."""
    s = track.scales
    teeth = TEETH if track.units == "rotary" else TEETH * 2 * math.pi / s.span
    return {"amplitude": 0.05 * s.peak_torque, "teeth": teeth}


def period(values: Row) -> float:
    """From tooth to tooth, rad or m."""
    return 2 * math.pi / values["teeth"]


def _observer_response(torque: np.ndarray, track: JointTrack, row: Row, channels: int) -> np.ndarray:
    """What a small torque [..., E, T] leaves in the last channel of the observer's residual: a linear filter."""
    if track.servo:
        return _servo_response(torque, track, row, channels)
    step, keep = track.sample_time, 1 - LEAK
    decay = keep * math.exp(-row["viscous_damping"] * step / row["inertia"])
    moves = np.abs(track.observed[..., 1]) > 0.02 * np.nanmax(np.abs(track.observed[..., 1]))
    kicks = torque * moves * (step / row["inertia"])
    velocity = lfilter([0.0, 1.0], [1.0, -decay], kicks, axis=-1)
    return velocity if channels == 2 else lfilter([0.0, step], [1.0, -keep], velocity, axis=-1)


def _servo_response(torque: np.ndarray, track: JointTrack, row: Row, channels: int) -> np.ndarray:
    """The same of a position servo, which runs free: its own law is the filter. (Samples are taken as even.)"""
    stiffness = row["torque_constant"] * row["proportional_gain"]
    damping = row["viscous_damping"] + row["torque_constant"] * row["derivative_gain"]
    rate = np.array([[0.0, 1.0], [-stiffness / row["inertia"], -damping / row["inertia"]]])
    shown = np.eye(2)[[channels - 1]]
    law = cont2discrete((rate, np.array([[0.0], [1 / row["inertia"]]]), shown, np.zeros((1, 1))), track.sample_time)
    top, bottom = ss2tf(*law[:4])
    return np.asarray(lfilter(top[0], bottom, np.nan_to_num(torque), axis=-1))


JOINT_FITS.register(
    "cogging",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little is seen of the position",
        excited_by="slow motion in one direction over the whole range of positions",
        along=("position",),
        period=period,
    ),
)
