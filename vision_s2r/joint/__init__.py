"""The drive of a joint: machines and commands in, what their encoders show out.

`simulate(machines, command, first, sample_time)` runs many machines over many episodes in compiled code. A machine is
a row of numbers, `pack(nominal, effects)`; an effect is a class in a file of `joint/effects`, with its formula. Beside
the effects, `Tables` add torques that are free functions of position, velocity or time. `Joints` are stepped a sample
at a time, for controllers.
"""

from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect, unit
from vision_s2r.joint.machine import COLUMNS, DYNAMICS, SERVO, Nominal, pack, pack_many
from vision_s2r.joint.simulate import simulate
from vision_s2r.joint.stepping import Joints
from vision_s2r.joint.tables import Tables

__all__ = [
    "COLUMNS",
    "DYNAMICS",
    "JOINT_EFFECTS",
    "SERVO",
    "JointEffect",
    "Joints",
    "Nominal",
    "Tables",
    "pack",
    "pack_many",
    "simulate",
    "unit",
]
