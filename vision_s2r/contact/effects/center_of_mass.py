"""The body is heavier on one side."""

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.effects import Parameter


@CONTACT_EFFECTS.register
class CenterOfMass(ContactEffect):
    """The centre of mass lies at (x, y, z) in the body's frame, from the centre of its shape.

    The inertia about it is that of the uniform body about its centre.
    """

    name = "center_of_mass"
    source = "contact"
    parameters = tuple(Parameter(axis, "m", low=-1.0, high=1.0, neutral=0.0, moderate=0.01) for axis in "xyz")
