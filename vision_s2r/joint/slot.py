"""Where effects act that are no more than a torque on the motor: the sum of their formulas, built into the kernels."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect
from vision_s2r.joint.machine import COLUMNS, JointMachine


@compiled
def _no_torque(machine: JointMachine, position: float, velocity: float, time: float) -> float:
    return 0.0


@compiled
def _off(machine: JointMachine) -> bool:
    return False


def _first(effect: JointEffect) -> int:
    return COLUMNS.index(f"{effect.name}.{effect.parameters[0].name}")


def _sum(effects: Sequence[JointEffect]) -> Callable[..., float]:
    """(machine, position, velocity, time) -> torque on the motor."""
    total = _no_torque
    for effect in effects:
        total = _plus(total, effect.motor_torque, _first(effect), _first(effect) + len(effect.parameters))
    return total


def _plus(others: Any, torque: Any, first: int, last: int) -> Any:
    @compiled
    def total(machine: JointMachine, position: float, velocity: float, time: float) -> float:
        return others(machine, position, velocity, time) + torque(position, velocity, time, *machine[first:last])

    return total


def _any(effects: Sequence[JointEffect]) -> Callable[..., bool]:
    """(machine) -> whether any of these is switched on."""
    found = _off
    for effect in effects:
        first = _first(effect)
        for k, parameter in enumerate(effect.parameters):
            if parameter.neutral is not None:
                found = _or(found, first + k, parameter.neutral)
        if all(parameter.neutral is None for parameter in effect.parameters):
            found = _or_given(found, first)
    return found


def _or(others: Any, column: int, neutral: float) -> Any:
    @compiled
    def found(machine: JointMachine) -> bool:
        return others(machine) or machine[column] != neutral

    return found


def _or_given(others: Any, column: int) -> Any:
    @compiled
    def found(machine: JointMachine) -> bool:
        return others(machine) or not math.isnan(machine[column])

    return found


_SLOT = [effect for effect in JOINT_EFFECTS if effect.motor_torque is not None]

slot_torque = _sum(_SLOT)
slot_on = _any(_SLOT)
slot_needs_velocity = _any([effect for effect in _SLOT if effect.of_velocity])
