"""A machine: what the simulator believes of a body on its support, with effects, as one flat row of numbers."""

import math
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vision_s2r.contact import effects as _effects  # noqa: F401  (fills the registry)
from vision_s2r.contact.effect import CONTACT_EFFECTS
from vision_s2r.errors import UserError


@dataclass(frozen=True)
class NominalContact:
    """The nominal simulator: a rigid body on a rigid plane, Newton's restitution, Coulomb's cone. SI units."""

    mass: float
    lateral_friction: float
    restitution: float
    gravity: float = 9.81


COEFFICIENTS = ("lateral_friction", "restitution")  # the effects that replace a nominal value

# The flat layout of one machine: the nominal values, then every parameter of every other effect.
_OF_EFFECTS = [
    f"{effect.name}.{parameter.name}"
    for effect in CONTACT_EFFECTS
    if effect.name not in COEFFICIENTS
    for parameter in effect.parameters
]
COLUMNS: tuple[str, ...] = ("mass", *COEFFICIENTS, "gravity", *_OF_EFFECTS)
INDEX = {column: k for k, column in enumerate(COLUMNS)}

# The same as fields, for the compiled code: machine.support_tilt_roll.
if TYPE_CHECKING:
    ContactMachine = Any
else:
    ContactMachine = namedtuple("ContactMachine", [column.replace(".", "_") for column in COLUMNS])


def column_of(effect: str, parameter: str) -> int:
    """Where a parameter stands in a machine's row."""
    return INDEX[effect if effect in COEFFICIENTS else f"{effect}.{parameter}"]


def pack(nominal: NominalContact, values: Mapping[str, Mapping[str, float]]) -> np.ndarray:
    """The row [P] float64, laid out as COLUMNS, of a machine with these effects (by name, parameters by name).

    Raises UserError for a name that is not known, or a value out of bounds.
    """
    row = np.zeros(len(COLUMNS))
    row[INDEX["contact_compliance.stiffness"]] = math.inf
    given = (nominal.mass, nominal.lateral_friction, nominal.restitution, nominal.gravity)
    row[: len(given)] = given
    if not (np.isfinite(given).all() and nominal.mass > 0 and min(given) >= 0 and nominal.restitution <= 1):
        raise UserError(f"nominal {nominal}: expected a mass above 0, gravity, friction, and restitution from 0 to 1")
    for name, parameters in values.items():
        for parameter, value in CONTACT_EFFECTS[name].check(parameters).items():
            row[column_of(name, parameter)] = value
    return row
