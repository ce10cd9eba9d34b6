"""BAM's friction models of a servo that swings a load, on their own: rivals of the diagnosis, of other code than its.

Duclusaud, Passault, Padois and Ly 2024, "Extended friction models for the physics simulation of servo actuators": M1 to
M6, each free run compared by its mean absolute error, its parameters searched for without gradients. Here by SciPy's
differential evolution, RUNS runs of all logs for each model, and a descent from the best.
"""

import math
from collections.abc import Sequence

import numba
import numpy as np
from scipy.optimize import differential_evolution

from vision_s2r.joint.compiled import compiled
from vision_s2r.recording import JointRecording

# What a model may free, least and most, and its unit's power of torque: in units of the most that the drive gives.
BOUNDS: dict[str, tuple[float, float, int]] = {
    "inertia": (0.3, 4.0, 0),  # of what is believed
    "torque": (0.2, 5.0, 0),  # of what is believed
    "back_emf": (0.0, 1.0, 1),
    "offset": (-0.1, 0.1, 0),
    "coulomb": (0.0, 0.1, 1),
    "viscous": (0.0, 0.1, 1),
    "stribeck": (0.0, 0.1, 1),
    "stribeck_velocity": (0.01, 3.0, 0),
    "stribeck_exponent": (0.5, 2.5, 0),
    "motor": (0.0, 0.5, 0),
    "external": (0.0, 0.5, 0),
    "motor_stribeck": (0.0, 0.5, 0),
    "external_stribeck": (0.0, 0.5, 0),
    "motor_quadratic": (0.0, 0.5, -1),
    "external_quadratic": (0.0, 0.5, -1),
}
NAMES = tuple(BOUNDS)
BASE = NAMES[:6]
STRIBECK = (*BASE, *NAMES[6:9])
NEUTRAL = {"inertia": 1.0, "torque": 1.0, "stribeck_velocity": 1.0, "stribeck_exponent": 1.0}  # else 0
# M3 and M4 have one value for both sides of the gearbox, the motor's.
MODELS: dict[str, tuple[str, ...]] = {
    "M1": BASE,
    "M2": STRIBECK,
    "M3": (*BASE, "motor"),
    "M4": (*STRIBECK, "motor", "motor_stribeck"),
    "M5": (*STRIBECK, *NAMES[9:13]),
    "M6": NAMES,
}
LONGEST_STEP = 1e-3  # s
POPULATION = 6  # of the search, for each free value
RUNS = 12000  # of all logs in a search, at most, before the descent
SEED = 0


@compiled
def friction(p: np.ndarray, motor: float, external: float, velocity: float) -> float:
    """Dry friction, N·m, at most, under these torques, N·m, at this velocity, rad/s; `p` in the order of NAMES."""
    at_rest = math.exp(-((abs(velocity) / p[7]) ** p[8]))
    loaded = abs(p[10] * external - p[9] * motor)
    static = p[6] + abs(p[12] * external - p[11] * motor)
    if motor * external < 0:  # the gearbox is loaded from both sides: the weaker one is driven
        if abs(motor) > abs(external):
            static += p[14] * external * external
        else:
            static += p[13] * motor * motor
    return p[4] + loaded + at_rest * static


@numba.njit(cache=True, nogil=True, error_model="numpy")
def run(p: np.ndarray, drive: np.ndarray, rows: np.ndarray, first: np.ndarray, longest: float) -> np.ndarray:
    """Positions [T] from a first position and velocity, semi-implicitly.

    `drive` is inertia, gravity's torque, gain (0: rows are torques) and limit; `rows` [T, 3] time, command and supply.
    """
    inertia, weight, gain, limit = drive[0] * p[0], drive[1], drive[2], drive[3]
    position, velocity = first[0], first[1]
    out = np.empty(len(rows))
    for k in range(len(rows)):
        out[k] = position
        if k + 1 == len(rows):
            break
        count = max(math.ceil((rows[k + 1, 0] - rows[k, 0]) / longest - 1e-6), 1)
        step = (rows[k + 1, 0] - rows[k, 0]) / count
        command, supply = rows[k, 1], rows[k, 2]
        for _ in range(count):
            asked = command if gain == 0 else gain * (command - position)
            motor = p[1] * min(max(asked, -limit), limit) * supply
            if supply > 0:
                motor -= p[2] * velocity
            external = -weight * math.sin(position - p[3])
            to_rest = inertia / step * velocity + motor + external
            most = friction(p, motor, external, velocity) + p[5] * abs(velocity)
            velocity = (to_rest - min(max(to_rest, -most), most)) * step / inertia
            position += step * velocity
    return out


def packed(model: str, free: np.ndarray) -> np.ndarray:
    """Values in the order of NAMES, of a model's free ones in its order."""
    given = dict(zip(MODELS[model], free, strict=True))
    one_sided = {name.replace("motor", "external"): value for name, value in given.items() if "motor" in name}
    given = NEUTRAL | one_sided | given
    return np.array([given.get(name, 0.0) for name in NAMES])


Log = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # drive, rows and first of `run`, and positions [T]


def logs_of(recording: JointRecording) -> list[Log]:
    """The recording's episodes as `run` wants them."""
    nominal = recording.nominal
    absent = {"gravity_torque": 0.0, "proportional_gain": 0.0, "command_limit": math.inf}
    drive = np.array([nominal["inertia"], *(nominal.get(name, value) for name, value in absent.items())])
    gains = np.ones(len(recording)) if recording.gains is None else recording.gains
    drives = [drive * np.array([1.0, 1.0, factor, 1.0]) for factor in gains]
    scale = 1.0 if recording.servo else nominal["torque_constant"]
    supply = np.ones_like(recording.command) if recording.supply is None else recording.supply
    rows = np.stack([recording.time, scale * recording.command, supply], axis=-1)
    return [
        (drives[k], rows[k, :n], recording.first[k], recording.position[k, :n]) for k, n in enumerate(recording.lengths)
    ]


def errors(logs: Sequence[Log], p: np.ndarray) -> list[float]:
    """Mean absolute error of each log's position in free run, rad or m."""
    return [
        float(np.mean(np.abs(run(p, drive, rows, first, LONGEST_STEP) - position)))
        for drive, rows, first, position in logs
    ]


def error(recording: JointRecording, p: np.ndarray) -> float:
    """The mean of its logs' errors."""
    return float(np.mean(errors(logs_of(recording), p)))


def fit(model: str, recording: JointRecording) -> np.ndarray:
    """The model's values, in the order of NAMES, of least mean absolute error over all logs."""
    strongest = recording.nominal["torque_constant"] * float(np.max(np.abs(recording.command)))
    most = recording.nominal.get("command_limit", strongest)
    bounds = [(low * most**power, high * most**power) for low, high, power in (BOUNDS[n] for n in MODELS[model])]
    logs = logs_of(recording)
    found = differential_evolution(
        lambda free: float(np.mean(errors(logs, packed(model, free)))),
        bounds,
        popsize=POPULATION,
        maxiter=max(RUNS // (POPULATION * len(bounds)) - 1, 1),
        init="sobol",
        rng=SEED,
    )
    return packed(model, found.x)
