"""Sliding is easier or harder than believed."""

import math

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class LateralFriction(ContactEffect):
    """μ of Coulomb's cone, |tangential force| ≤ μ·normal force, at every point of contact."""

    name = "lateral_friction"
    source = "contact"
    parameters = (Parameter("value", "", low=0.0, high=10.0, neutral=None, moderate=0.25),)


@compiled
def in_cone(x: float, y: float, most: float) -> tuple[float, float]:
    """The tangential impulse nearest to (x, y) that is no larger than `most`."""
    size = math.sqrt(x * x + y * y)
    if size <= most:
        return x, y
    scale = most / size
    return scale * x, scale * y
