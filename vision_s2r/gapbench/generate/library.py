"""The joint effects of the vocabulary as the generator draws them: families of machines that grow in one intensity.

A family maps an intensity in (0, 1] to the fields of a `DriveModel`; what besides is free (a sign, a speed, a number of
teeth) is drawn with the family. Towards 0 the effect vanishes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from vision_s2r.gapbench.generate.drive import DriveModel

Fields = dict[str, float]
Family = Callable[[float], Fields]


@dataclass(frozen=True)
class Scale:
    """What is large for one joint under its excitation."""

    torque: float  # N·m, largest of the motor
    speed: float  # rad/s, largest
    range: float  # rad, of positions


Draw = Callable[[DriveModel, Scale, np.random.Generator], Family]


def _factor(field: str) -> Draw:
    """A wrong value, up to twice or half the nominal one."""

    def draw(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
        sign = rng.choice([-1.0, 1.0])
        return lambda x: {field: getattr(nominal, field) * 2.0 ** (sign * x)}

    return draw


def _offset(field: str) -> Draw:
    """A wrong value, off by up to half the motor's torque (a gravity torque is never negative)."""

    def draw(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
        sign = 1.0 if field == "gravity_torque" else rng.choice([-1.0, 1.0])
        return lambda x: {field: getattr(nominal, field) + sign * x * 0.5 * scale.torque}

    return draw


def _stribeck(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    velocity = rng.uniform(0.1, 0.6)
    return lambda x: {
        "static": nominal.coulomb_friction + 0.3 * x * scale.torque,
        "stribeck_velocity": velocity,
    }


def _load_friction(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"load_friction": 0.5 * x}


def _backlash(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"width": 0.2 * x}


def _saturation(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"limit": scale.torque * (1 - 0.8 * x)}


def _torque_speed(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    reach = rng.uniform(1.0, 2.5)
    return lambda x: {"stall": scale.torque * 3 ** (1 - 2 * x), "no_load_speed": reach * scale.speed}


def _latency(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"delay": 0.06 * x}


def _quantization(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    return lambda x: {"resolution": 0.03 * x}


def _cogging(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    teeth = float(rng.integers(4, 25))
    return lambda x: {"cogging": 0.4 * x * scale.torque, "teeth": teeth}


def _thermal(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    most = rng.choice([-0.1, 0.3])  # 1/s; the damping stays positive over 8 s
    return lambda x: {"thermal_rate": most * x}


def _asymmetric(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    signs = rng.choice([-1.0, 1.0], size=2)
    shares = rng.uniform(0.3, 0.9, size=2)

    def family(x: float) -> Fields:
        viscous, coulomb = x * signs * shares * (nominal.viscous_damping, nominal.coulomb_friction)
        return {"viscous_asymmetry": viscous, "coulomb_asymmetry": coulomb}

    return family


def _compliance(nominal: DriveModel, scale: Scale, rng: np.random.Generator) -> Family:
    ratio = rng.uniform(0.02, 0.3)  # of critical damping

    def family(x: float) -> Fields:
        frequency = min(20.0 / x, 1000.0)  # rad/s, of the two halves against each other
        reduced = nominal.inertia / 4
        return {"stiffness": reduced * frequency**2, "spring_damping": 2 * ratio * reduced * frequency}

    return family


@dataclass(frozen=True)
class KnownEffect:
    """An effect of the vocabulary: how it is drawn, where a report finds it, parameters as fields of `DriveModel`."""

    draw: Draw
    parameters: Mapping[str, str]  # of the vocabulary -> of `DriveModel`
    where: tuple[str, ...] = ()  # axes on which it shows
    source: str = "actuator"


def _dynamics(field: str, draw: Draw, *where: str) -> KnownEffect:
    return KnownEffect(draw, {"value": field}, where, "dynamics")


DYNAMICS = {
    "viscous_damping": _dynamics("viscous_damping", _factor("viscous_damping"), "velocity"),
    "coulomb_friction": _dynamics("coulomb_friction", _factor("coulomb_friction")),
    "inertia": _dynamics("inertia", _factor("inertia")),
    "gravity_torque": _dynamics("gravity_torque", _offset("gravity_torque")),
    "bias_torque": _dynamics("bias_torque", _offset("bias_torque")),
    "torque_constant": _dynamics("torque_constant", _factor("torque_constant")),
}
ACTUATOR = {
    "stribeck_friction": KnownEffect(
        _stribeck, {"static": "static", "velocity": "stribeck_velocity"}, ("velocity", "reversal", "rest")
    ),
    "load_dependent_friction": KnownEffect(_load_friction, {"coefficient": "load_friction"}),
    # Friction is the motor's: the load goes on by itself, and the play is gone through when it is no longer pushed, at
    # changes of the acceleration's sign. Within 50 ms after these, a third of the time, is 0.7 to 0.98 of what it does.
    "backlash": KnownEffect(_backlash, {"width": "width"}, ("acceleration",)),
    "torque_saturation": KnownEffect(_saturation, {"limit": "limit"}, ("torque", "velocity")),
    "torque_speed_limit": KnownEffect(
        _torque_speed, {"stall": "stall", "no_load_speed": "no_load_speed"}, ("torque", "velocity")
    ),
    "latency": KnownEffect(_latency, {"delay": "delay"}),
    "encoder_quantization": KnownEffect(_quantization, {"resolution": "resolution"}),
    "cogging": KnownEffect(_cogging, {"amplitude": "cogging", "teeth": "teeth"}, ("position",)),
    "thermal_drift": KnownEffect(_thermal, {"rate": "thermal_rate"}, ("time",)),
    "asymmetric_friction": KnownEffect(
        _asymmetric, {"viscous": "viscous_asymmetry", "coulomb": "coulomb_asymmetry"}, ("direction", "velocity")
    ),
    "compliance": KnownEffect(_compliance, {"stiffness": "stiffness", "damping": "spring_damping"}),
}
LIBRARY = DYNAMICS | ACTUATOR

# Combinations that the vocabulary leaves open (which inertia carries the cogging, what drifts of an asymmetric
# damping, from which level a static friction decays, what presses the gears of two masses), or that are one thing but
# for noise.
_APART = [
    {"backlash", "compliance"},
    {"cogging", "backlash"},
    {"cogging", "compliance"},
    {"stribeck_friction", "asymmetric_friction"},
    {"thermal_drift", "asymmetric_friction"},
    {"asymmetric_friction", "bias_torque"},
    {"external_load_friction", "backlash"},
    {"external_load_friction", "compliance"},
]


def compatible(names: tuple[str, ...]) -> bool:
    """Whether the vocabulary defines what these effects do together."""
    return len(set(names)) == len(names) and not any(pair <= set(names) for pair in _APART)


# Fields that scale with the torque constant when the torque balance is divided by it
TORQUES = (
    *(
        "torque_constant",
        "inertia",
        "viscous_damping",
        "coulomb_friction",
        "gravity_torque",
        "bias_torque",
        "static",
    ),
    *("limit", "stall", "cogging", "viscous_asymmetry", "coulomb_asymmetry", "stiffness", "spring_damping"),
)
