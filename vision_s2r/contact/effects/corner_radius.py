"""Edges and corners are round."""

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.effects import Parameter


@CONTACT_EFFECTS.register
class CornerRadius(ContactEffect):
    """All edges and corners of a box or a mesh are round, of this radius; its faces stay where they are.

    What touches is a ball in each corner of the body whose faces are moved inwards by the radius. Mass and inertia are
    those of the sharp body. A radius beyond 95 % of the depth counts as that; a sphere or cylinder has no corners.
    """

    name = "corner_radius"
    source = "contact"
    parameters = (Parameter("value", "m", low=0.0, high=1.0, neutral=0.0, moderate=0.005),)
