"""Rolling is braked: the support gives way a little under the body."""

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.contact.lanes import Lanes
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class RollingFriction(ContactEffect):
    """A torque against the rolling part of the spin, of at most `value` times the normal force.

    As PyBullet's rollingFriction, with a support of lateralFriction 1; numerically a length in metres.
    """

    name = "rolling_friction"
    source = "contact"
    parameters = (Parameter("value", "", low=0.0, high=1.0, neutral=0.0, moderate=0.01),)


@compiled
def rolling_limit(coefficient: Lanes, normal_impulse: Lanes) -> Lanes:
    """The largest angular impulse about an axis in the support."""
    return coefficient * normal_impulse
