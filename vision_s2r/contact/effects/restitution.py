"""Impacts rebound more or less than believed."""

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.contact.lanes import Lanes, where
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class Restitution(ContactEffect):
    """e of Newton's law, normal velocity after = −e·before, at every point that hits; at slow impacts there is none."""

    name = "restitution"
    source = "contact"
    parameters = (Parameter("value", "", low=0.0, high=1.0, neutral=None, moderate=0.4),)


SLOW = 0.02  # m/s: points that approach more slowly are in touch and do not rebound


@compiled
def rebound(approach: Lanes, restitution: Lanes) -> Lanes:
    """Normal velocity after an impact with this one (negative: towards the support) before it."""
    return where(approach < -SLOW, -restitution * approach, 0.0)
