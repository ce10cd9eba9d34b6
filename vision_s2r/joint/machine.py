"""A machine: what the simulator believes of a joint, with effects, as one flat row of numbers."""

import math
from collections import namedtuple
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numba.cpython.unsafe.tuple import tuple_setitem

from vision_s2r.effects import Parameter
from vision_s2r.errors import UserError
from vision_s2r.joint import effects as _effects  # noqa: F401  (fills the registry)
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS
from vision_s2r.joint.pointer import Pointer, numbers


@dataclass(frozen=True)
class NominalJoint:
    """The nominal simulator: J·θ̈ = K·u − b·θ̇ − τ_f·sign(θ̇) − τ_g·sin θ − τ_0. SI units, rotary or linear.

    The encoder shows θ + position_offset. While its drive is on, a motor brakes itself by back_emf·θ̇ besides. With a
    proportional gain the joint is a position servo: it is commanded by target positions, and
    u = clip(proportional_gain·(target − θ) − derivative_gain·θ̇, ±command_limit) at every moment.
    """

    torque_constant: float
    inertia: float
    viscous_damping: float
    coulomb_friction: float
    gravity_torque: float = 0.0
    bias_torque: float = 0.0
    position_offset: float = 0.0
    back_emf: float = 0.0
    proportional_gain: float | None = None  # None: no servo
    derivative_gain: float = 0.0
    command_limit: float = math.inf

    def asked(
        self, target: np.ndarray, position: np.ndarray, velocity: np.ndarray, gains: np.ndarray | float = 1.0
    ) -> np.ndarray:
        """What a position servo's law asks of its motor, u, in these states (of one shape), its gains times `gains`."""
        assert self.proportional_gain is not None
        u = gains * (self.proportional_gain * (target - position) - self.derivative_gain * velocity)
        return np.clip(u, -self.command_limit, self.command_limit)


_NOMINAL = tuple(field.name for field in fields(NominalJoint))
DYNAMICS = tuple(name for name in _NOMINAL if name in JOINT_EFFECTS)  # the effects that replace a nominal value
# What is refitted to any recording; others take a gain, a load or a drive that is off to be told apart.
REFITTED = ("inertia", "viscous_damping", "coulomb_friction", "gravity_torque", "bias_torque")
SERVO = tuple(effect.name for effect in JOINT_EFFECTS if effect.servo)  # the effects of position servos alone

# The flat layout of one machine: the nominal values, then every parameter of every effect of the drive.
COLUMNS: tuple[str, ...] = _NOMINAL + tuple(
    f"{effect.name}.{parameter.name}"
    for effect in JOINT_EFFECTS
    if effect.source == "actuator"
    for parameter in effect.parameters
)

JOINT_EFFECTS.close("the simulator is laid out; import its module earlier, or install it as an entry point")

# The same as fields, for the compiled code: machine.backlash_width.
if TYPE_CHECKING:
    JointMachine = Any
else:
    JointMachine = namedtuple("JointMachine", [column.replace(".", "_") for column in COLUMNS])

LONGEST_DELAY = 3600.0  # s

_WIDTH = len(COLUMNS)
_INDEX = {column: k for k, column in enumerate(COLUMNS)}
_INERTIA = COLUMNS.index("inertia")
_PROPORTIONAL, _DERIVATIVE = COLUMNS.index("proportional_gain"), COLUMNS.index("derivative_gain")
_RESOLUTION = COLUMNS.index("encoder_quantization.resolution")
_ON_ERROR = COLUMNS.index("derivative_on_error.gain")


def _absent() -> np.ndarray:
    """A machine without effects: neutral values, and NaN where a parameter has none."""
    row = np.full(len(COLUMNS), math.nan)
    row[: len(_NOMINAL)] = 0.0
    row[_INDEX["proportional_gain"]] = math.nan
    for effect in JOINT_EFFECTS:
        for parameter in effect.parameters:
            if effect.source == "actuator" and parameter.neutral is not None:
                row[_INDEX[f"{effect.name}.{parameter.name}"]] = parameter.neutral
    return row


_ABSENT = _absent()


def pack(nominal: NominalJoint, values: Mapping[str, Mapping[str, float]]) -> np.ndarray:
    """The row [P] float64, laid out as COLUMNS, of a machine with these effects (by name, parameters by name).

    An effect of the dynamics replaces its nominal value, one of the drive is added. What is absent is at its neutral
    value, or NaN where it has none. Raises UserError for a name that is not known, a value out of bounds, or an effect
    of position servos on a joint that is none.
    """
    row = _ABSENT.copy()
    for name, value in asdict(nominal).items():
        if value is None:
            continue
        if not math.isfinite(value) and not (name == "command_limit" and value == math.inf):
            raise UserError(f"nominal {name} is {value}, expected a finite number")
        row[_INDEX[name]] = value
    for name in ("inertia", "command_limit"):
        if row[_INDEX[name]] <= 0:
            raise UserError(f"nominal {name} is {row[_INDEX[name]]:g}, expected more than 0")
    if nominal.proportional_gain is None and (wrong := [name for name in values if name in SERVO]):
        raise UserError(f"{wrong[0]} is of a position servo, but this joint is commanded by currents or torques")
    for name, given in values.items():
        effect = JOINT_EFFECTS[name]
        for parameter, value in effect.check(given).items():
            row[_INDEX[name if name in DYNAMICS else f"{name}.{parameter}"]] = value
    return row


def pack_many(nominal: NominalJoint, values: Mapping[str, Mapping[str, np.ndarray]], count: int) -> np.ndarray:
    """Rows [count, P] as `pack` makes them, each parameter an array [count].

    Raises UserError for a name that is not known, or a value out of bounds.
    """
    rows = np.repeat(pack(nominal, {})[None], count, axis=0)
    for name, given in values.items():
        effect = JOINT_EFFECTS[name]
        for extreme in (np.min, np.max):
            effect.check({key: _extreme(effect.parameter(key), value, extreme) for key, value in given.items()})
        for key, value in given.items():
            rows[:, _INDEX[name if name in DYNAMICS else f"{name}.{key}"]] = value
    return rows


def _extreme(parameter: Parameter, value: np.ndarray, extreme: Callable[[np.ndarray], Any]) -> float:
    """The smallest or largest of the values that are not neutral."""
    switched_on = value[value != parameter.neutral]
    return float(extreme(switched_on if len(switched_on) else value))


@compiled
def machine_at(row: Pointer) -> JointMachine:
    """The machine that a row of `pack` is."""
    return JointMachine(*numbers(row, _WIDTH))


@compiled
def of_inertia(machine: JointMachine, inertia: float) -> JointMachine:
    """The same machine with another inertia."""
    return tuple_setitem(machine, _INERTIA, inertia)  # type: ignore[call-arg]  # its typing context is numba's


@compiled
def continuous(machine: JointMachine) -> JointMachine:
    """The same machine with an encoder that shows no steps."""
    return tuple_setitem(machine, _RESOLUTION, 0.0)  # type: ignore[call-arg]


@compiled
def of_gains(machine: JointMachine, factor: float) -> JointMachine:
    """The same servo with all of its gains times this factor."""
    machine = tuple_setitem(machine, _PROPORTIONAL, factor * machine.proportional_gain)  # type: ignore[call-arg]
    machine = tuple_setitem(machine, _ON_ERROR, factor * machine.derivative_on_error_gain)
    return tuple_setitem(machine, _DERIVATIVE, factor * machine.derivative_gain)


def check(machines: np.ndarray) -> None:
    """UserError where a machine of [C, P] is none: NaN where it must not be, no inertia, a delay into the past."""
    broken = np.isnan(machines) & ~np.isnan(_ABSENT)
    broken[:, _INDEX["inertia"]] |= machines[:, _INDEX["inertia"]] <= 0
    delay = machines[:, _INDEX["latency.delay"]]
    broken[:, _INDEX["latency.delay"]] |= ~((delay >= 0) & (delay < LONGEST_DELAY))
    if broken.any():
        machine, column = np.argwhere(broken)[0]
        raise UserError(f"machine {machine}: {COLUMNS[column]} is {machines[machine, column]:g}, which cannot be")
