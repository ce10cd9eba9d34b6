"""The drive of a joint: machines and commands in, what their encoders show out.

`simulate(machines, command, first, sample_time)` runs many machines over many episodes in compiled code. A machine is
a row of numbers, `pack(nominal, effects)`; an effect is a class in a file of `joint/effects`, with its formula. Beside
the effects, `Tables` add torques that are free functions of position, velocity or time. `Joints` are stepped a sample
at a time, for controllers.

Names are imported when they are first asked for: what only declares an effect (`joint.effect`) comes before the
simulator, whose layout holds all of them.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vision_s2r.joint.effect import JointEffect, unit
    from vision_s2r.joint.machine import (
        COLUMNS,
        DYNAMICS,
        JOINT_EFFECTS,
        REFITTED,
        SERVO,
        NominalJoint,
        pack,
        pack_many,
    )
    from vision_s2r.joint.simulation import simulate
    from vision_s2r.joint.stepping import Joints
    from vision_s2r.joint.tables import Tables

__all__ = [
    "COLUMNS",
    "DYNAMICS",
    "JOINT_EFFECTS",
    "REFITTED",
    "SERVO",
    "JointEffect",
    "Joints",
    "NominalJoint",
    "Tables",
    "pack",
    "pack_many",
    "simulate",
    "unit",
]

_HOMES = {"JointEffect": "effect", "Joints": "stepping", "Tables": "tables", "simulate": "simulation", "unit": "effect"}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    found = getattr(importlib.import_module(f"{__name__}.{_HOMES.get(name, 'machine')}"), name)
    globals()[name] = found
    return found
