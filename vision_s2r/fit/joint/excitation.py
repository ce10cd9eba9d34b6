"""What a recording could not have shown: each effect at a plausible size, and how far it moves the residual."""

import math

import numpy as np

from vision_s2r.fit.case import Hypothesis
from vision_s2r.fit.joint.fitter import JointFitter, names_of
from vision_s2r.fit.joint.track import Track

DETECTABLE = 20.0  # nats that an effect of plausible size should bring
TEETH = 12  # of a turn, or of the travel


def plausible(track: Track, row: dict[str, float]) -> dict[str, dict[str, float]]:
    """By effect, a size that an engineer would care about in this machine."""
    s = track.scales
    rotary = track.units == "rotary"
    peak = s.peak_torque
    held = row["coulomb_friction"] + abs(row["gravity_torque"]) + abs(row["bias_torque"])
    top_speed = min(peak / row["viscous_damping"], 4 * s.peak_speed) if row["viscous_damping"] > 0 else 4 * s.peak_speed
    frequency = min(10.0, 0.2 / track.sample_time)
    stiffness = row["inertia"] / 4 * (2 * math.pi * frequency) ** 2
    sizes: dict[str, dict[str, float]] = {
        "stribeck_friction": {
            "static": row["coulomb_friction"] * 1.5 + 0.01 * s.torque,
            "velocity": max(0.05 * top_speed, 0.02 * s.peak_speed),
        },
        "load_dependent_friction": {"coefficient": 0.1},
        "backlash": {"width": 0.02 if rotary else 0.002 * s.span},
        "torque_speed_limit": {"stall": 1.2 * peak, "no_load_speed": max(1.5 * top_speed, 1.1 * s.peak_speed)},
        "latency": {"delay": 0.5 * track.sample_time},
        "cogging": {"amplitude": 0.05 * peak, "teeth": TEETH if rotary else TEETH * 2 * math.pi / s.span},
        "thermal_drift": {"rate": 0.05 if s.duration * 0.05 < 1 else 0.5 / s.duration},
        "asymmetric_friction": {"viscous": 0.1 * row["viscous_damping"], "coulomb": 0.1 * row["coulomb_friction"]},
        "compliance": {"stiffness": stiffness, "damping": 0.2 * math.sqrt(stiffness * row["inertia"] / 4)},
        "gravity_torque": {"value": row["gravity_torque"] + 0.1 * peak},
        "bias_torque": {"value": row["bias_torque"] + 0.03 * peak},
        "inertia": {"value": row["inertia"] * 1.1},
        "viscous_damping": {"value": row["viscous_damping"] + 0.1 * peak / max(top_speed, 1e-12)},
        "coulomb_friction": {"value": row["coulomb_friction"] * 1.2 + 0.005 * peak},
    }
    limit = max(0.7 * peak, 2.5 * held)
    if limit < 0.98 * peak:  # a drive that can barely move its own friction is none
        sizes["torque_saturation"] = {"limit": limit}
    return sizes


REASONS = {
    "stribeck_friction": "too little slow motion",
    "load_dependent_friction": "the motor torque changes too little",
    "backlash": "no reversal under load that would have crossed the play",
    "torque_saturation": "the torque never comes near a plausible limit",
    "torque_speed_limit": "the speed is never high under torque",
    "latency": "the command changes too little",
    "cogging": "too little is seen of the position",
    "thermal_drift": "the episodes are too short, or too slow",
    "asymmetric_friction": "too little motion in both directions",
    "compliance": "nothing excites a vibration",
    "gravity_torque": "too little is seen of the position",
    "bias_torque": "a constant torque would not have shown",
    "inertia": "too little acceleration",
    "viscous_damping": "too little speed",
    "coulomb_friction": "too little motion",
}


def not_excited(fitter: JointFitter, base: Hypothesis, noise: np.ndarray, names: list[str]) -> dict[str, str]:
    """Of these effects, those that the recording could not have shown, and why."""
    space = fitter.space(names_of(base))
    row = space.row(space.start(base))
    sizes = plausible(fitter.track, row)
    found = {}
    for name in names:
        if name in ("torque_constant", "encoder_quantization"):
            continue
        if name not in sizes or fitter.shows(base, name, sizes[name], noise) < DETECTABLE:
            found[name] = REASONS[name]
    return found
