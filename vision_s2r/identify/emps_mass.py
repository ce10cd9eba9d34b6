"""Which physics makes forward and inverse identification of the real axis disagree on its mass.

Terms that the axis may have beside asymmetric friction, functions of its position, are fitted by the inverse method,
and given to the forward one as known forces.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from scipy.signal import butter, savgol_filter, sosfiltfilt

from vision_s2r.fit.joint.free_run import free_run
from vision_s2r.identify.config import HoldConfig, IdentifyConfig, InverseConfig
from vision_s2r.identify.identify import identify
from vision_s2r.identify.inverse import Inverse, regression
from vision_s2r.recording import JointRecording

Terms: TypeAlias = Callable[[np.ndarray, float], list[np.ndarray]]  # (positions [T], sample time) -> forces [T]

ASYMMETRIC = "asymmetric_friction"
NAMES = frozenset({"inertia", "viscous_damping", "coulomb_friction", ASYMMETRIC})
WAVES = 6  # cosines over the way: the shortest is a third of it
CUT_OFF = 100.0  # Hz, of positions that are differentiated
PUBLISHED = -36.86, -0.245  # N·s/m, N: half of what friction one way has more than the other way
NOISE = 1e-6  # m, of positions
MOVING = 1e-3  # m/s: slower, friction holds whatever it must


def _derivative(position: np.ndarray, sample_time: float, order: int) -> np.ndarray:
    smooth = sosfiltfilt(butter(8, CUT_OFF, output="sos", fs=1 / sample_time), position)
    return np.asarray(savgol_filter(smooth, 9, 8, deriv=order, delta=sample_time))


def _force(position: np.ndarray, sample_time: float) -> list[np.ndarray]:
    way = (position - position.min()) / np.ptp(position)
    return [np.cos(np.pi * k * way) for k in range(1, WAVES + 1)]


def _friction(position: np.ndarray, sample_time: float) -> list[np.ndarray]:
    velocity = _derivative(position, sample_time, 1)
    direction = np.sign(velocity) * (np.abs(velocity) > MOVING)
    return [direction * wave for wave in _force(position, sample_time)]


def _compliance(position: np.ndarray, sample_time: float) -> list[np.ndarray]:
    """Where a spring with damping divides the mass, its third and fourth derivatives enter, to first order."""
    return [_derivative(position, sample_time, order) for order in (3, 4)]


def _both(position: np.ndarray, sample_time: float) -> list[np.ndarray]:
    return _friction(position, sample_time) + _force(position, sample_time)


TERMS: Mapping[str, Terms] = {
    "nothing": lambda position, sample_time: [],
    "a compliance": _compliance,
    "a force over the way": _force,
    "friction over the way": _friction,
    "both over the way": _both,
}


def mass_table(recordings: Mapping[str, JointRecording]) -> dict[str, Any]:
    """The mass (kg) that both methods find beside each of TERMS, and the forward one's error held out."""
    rows = []
    for name, recording in recordings.items():
        simulated = f"{name}, simulated with {recording.nominal['inertia']:.2f} kg"
        for title, log, terms in (
            *((f"{name}, {term}", recording, terms) for term, terms in TERMS.items()),
            (simulated, _simulated(recording), TERMS["nothing"]),
        ):
            inverse, load = _inverse(log, terms)
            rows.append([title, inverse, *_forward(log, load, terms is _compliance), round(float(load.std()), 2)])
    return {
        "command": "vision-s2r identify example=emps recording=DIR",
        "source": "beside asymmetric friction; mass and its 95 % interval; the free run's velocity held out, root mean "
        "square, as that of the terms; terms of the way were fitted by the inverse method to the whole recording",
        "columns": ["recording, and what it has besides", "inverse, kg", "forward, kg", "free run, mm/s", "terms, N"],
        "rows": rows,
    }


def _simulated(recording: JointRecording) -> JointRecording:
    """What the axis as published would have done under the same forces, with asymmetric friction and nothing else."""
    known = replace(recording, nominal=recording.nominal | {"bias_torque": 0.0})
    states = free_run(known, {ASYMMETRIC: {"viscous": PUBLISHED[0], "coulomb": PUBLISHED[1]}})
    noise = np.random.default_rng(0).normal(scale=NOISE, size=recording.position.shape)
    return replace(known, position=states[..., 0] + noise)


def _inverse(recording: JointRecording, terms: Terms) -> tuple[str, np.ndarray]:
    """The mass, and the forces [T] of the terms."""
    step, cfg = recording.sample_time, InverseConfig()
    forces = np.stack([*terms(recording.position[0], step), np.zeros(recording.position.shape[1])], axis=-1)[:, :-1]
    known = replace(recording, nominal=recording.nominal | {"bias_torque": 0.0})
    rows = regression(known, cfg, np.zeros(recording.position.shape, dtype=int), forces[None])
    method = Inverse(rows, known.nominal, NAMES)
    return _interval(method.estimate().intervals["inertia"]["value"]), forces @ method.terms()


def _forward(recording: JointRecording, load: np.ndarray, compliance: bool) -> tuple[str, float]:
    """The mass, and the error; a compliance is the simulator's own, other terms are the load that they are."""
    known = recording if compliance else replace(recording, external=-load[None])
    effects = [ASYMMETRIC, *(["compliance"] if compliance else [])]
    found = identify(known, IdentifyConfig(effects=effects, hold=HoldConfig(bias_torque=0.0)))
    error = 1e3 * float(np.sqrt(found.gap.after.mean()))
    return _interval(found.estimate.intervals["inertia"]["value"]), round(error, 2)


def _interval(interval: tuple[float, float]) -> str:
    low, high = interval
    return f"{(low + high) / 2:.2f} ± {(high - low) / 2:.2f}"
