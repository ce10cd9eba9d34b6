"""Where a fit of an effect may start: a few settings of each that between them are near any."""

import math
from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

from vision_s2r.fit.joint.track import LEAK, Scales, Track

Settings = list[dict[str, float]]
TEETH = 4  # numbers of teeth proposed
MOST_TEETH = 400  # numbers tried


def settings(name: str, track: Track, scales: Scales, row: dict[str, float], residuals: np.ndarray) -> Settings:
    """Settings of an effect beside a machine (`row`: its columns by name) that leaves `residuals` [E, T, channels]."""
    s, step = scales, track.sample_time
    spring = [row["inertia"] / 4 * (2 * math.pi * f) ** 2 for f in (2.5, 5, 9, 15, 25) if f < 0.35 / step]
    widths = np.geomspace(max(3e-4 * s.span, 1e-6), 0.4 * s.span, 14)
    friction = row["coulomb_friction"]
    table: dict[str, Callable[[], Settings]] = {
        "stribeck_friction": lambda: [
            {"static": friction + more * s.torque, "velocity": v * s.peak_speed}
            for more in (0.04, 0.15)
            for v in (0.01, 0.03, 0.1, 0.25)
        ],
        "load_dependent_friction": lambda: [{"coefficient": c} for c in (0.05, 0.2)],
        "backlash": lambda: [{"width": float(w)} for w in widths],
        "torque_saturation": lambda: [{"limit": x * s.peak_torque} for x in (0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 0.97)],
        "torque_speed_limit": lambda: [
            {"stall": x * s.peak_torque, "no_load_speed": v * s.peak_speed}
            for x in (0.6, 0.9, 1.3, 2.0)
            for v in (1.02, 1.3, 1.8, 3.0)
        ],
        "latency": lambda: [{"delay": x * step} for x in (0.3, 0.7, 1.3, 2.2, 3.5, 5.5, 8.0)],
        "cogging": lambda: _cogging(track, s, row, residuals),
        "thermal_drift": lambda: [{"rate": x / s.duration} for x in (-0.3, 0.4, 1.5)],
        "asymmetric_friction": lambda: [
            {"viscous": 0.1 * row["viscous_damping"] + 1e-3 * s.torque / s.speed, "coulomb": 0.0},
            {"viscous": 0.0, "coulomb": 0.02 * s.torque},
        ],
        "compliance": lambda: [
            {"stiffness": k, "damping": 2 * z * math.sqrt(k * row["inertia"] / 4)} for k in spring for z in (0.05, 0.3)
        ],
        "encoder_quantization": lambda: [{}],
        "torque_constant": lambda: [{"value": track.nominal.torque_constant * x} for x in (0.9, 1.1)],
        "inertia": lambda: [{"value": track.nominal.inertia * x} for x in (0.9, 1.1)],
        "viscous_damping": lambda: [{"value": track.nominal.viscous_damping + 0.1 * s.torque / s.speed}],
        "coulomb_friction": lambda: [{"value": track.nominal.coulomb_friction + 0.02 * s.torque}],
        "gravity_torque": lambda: [{"value": track.nominal.gravity_torque + 0.05 * s.torque}],
        "bias_torque": lambda: [{"value": track.nominal.bias_torque + 0.02 * s.torque}],
    }
    return table[name]()


def _cogging(track: Track, scales: Scales, row: dict[str, float], residuals: np.ndarray) -> Settings:
    """A periodogram over position: which sine of it, through the observer, is most like the residual."""
    slowest = 2 * math.pi / scales.span
    fastest = min(0.6 * math.pi / (scales.speed * track.sample_time), MOST_TEETH * slowest)
    teeth = np.arange(max(slowest, 0.5), max(fastest, 2 * slowest), 0.4 * slowest)
    response = observer_response(
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
        if len(best) == TEETH:
            break
    return [{"amplitude": float(max(amplitude[k], 1e-3 * scales.torque)), "teeth": float(teeth[k])} for k in best]


def observer_response(torque: np.ndarray, track: Track, row: dict[str, float], channels: int) -> np.ndarray:
    """What a small torque [..., E, T] leaves in the last channel of the observer's residual: a linear filter."""
    step, keep = track.sample_time, 1 - LEAK
    decay = keep * math.exp(-row["viscous_damping"] * step / row["inertia"])
    moves = np.abs(track.observed[..., 1]) > 0.02 * np.nanmax(np.abs(track.observed[..., 1]))
    kicks = torque * moves * (step / row["inertia"])
    velocity = lfilter([0.0, 1.0], [1.0, -decay], kicks, axis=-1)
    return velocity if channels == 2 else lfilter([0.0, step], [1.0, -keep], velocity, axis=-1)
