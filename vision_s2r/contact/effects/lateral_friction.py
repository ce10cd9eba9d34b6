"""Sliding is easier or harder than believed."""

import math

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.contact.lanes import Lanes, where
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class LateralFriction(ContactEffect):
    """μ of Coulomb's cone, |tangential force| ≤ μ·normal force, at every point of contact."""

    name = "lateral_friction"
    source = "contact"
    parameters = (Parameter("value", "", low=0.0, high=10.0, neutral=None, moderate=0.25),)


@compiled
def share_in_cone(x: Lanes, y: Lanes, most: Lanes) -> Lanes:
    """The share of the tangential impulse (x, y) that is no larger than `most`: 1 where all of it is."""
    square = x * x + y * y
    # most / √square, so that root and division do not wait for each other.
    return where(square <= most * most, 1.0, most / square * math.sqrt(square))


@compiled
def in_cone(x: Lanes, y: Lanes, most: Lanes) -> tuple[Lanes, Lanes]:
    """The tangential impulse nearest to (x, y) that is no larger than `most`."""
    share = share_in_cone(x, y, most)
    return share * x, share * y
