"""Spinning on the spot is braked: the contact is a patch, not a point."""

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.contact.lanes import Lanes
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class SpinningFriction(ContactEffect):
    """A torque against the spin about the support's normal, of at most `value` times the normal force.

    As PyBullet's spinningFriction, with a support of lateralFriction 1; numerically a length in metres.
    """

    name = "spinning_friction"
    source = "contact"
    parameters = (Parameter("value", "", low=0.0, high=1.0, neutral=0.0, moderate=0.01),)


@compiled
def spinning_limit(coefficient: Lanes, normal_impulse: Lanes) -> Lanes:
    """The largest angular impulse about the support's normal."""
    return coefficient * normal_impulse
