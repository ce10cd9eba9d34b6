"""A rigid convex body on a plane: machines and first states in, motion out.

`simulate(machines, shape, first, samples, sample_time)` runs many machines from many starts in compiled code. A machine
is a row of numbers, `pack(nominal, effects)`; an effect is a class in a file of `contact/effects`, with its formula.
Beside the effects, `Terms` add forces that are free functions of height, place, speed or time, and a friction that
depends on place, time, the speed or the direction of sliding.
"""

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.contact.machine import COEFFICIENTS, COLUMNS, NominalContact, column_of, pack
from vision_s2r.contact.shape import Shape, box, cylinder, mesh, sphere
from vision_s2r.contact.simulate import simulate
from vision_s2r.contact.terms import Terms

__all__ = [
    "COEFFICIENTS",
    "COLUMNS",
    "CONTACT_EFFECTS",
    "ContactEffect",
    "NominalContact",
    "Shape",
    "Terms",
    "box",
    "column_of",
    "cylinder",
    "mesh",
    "pack",
    "simulate",
    "sphere",
]
