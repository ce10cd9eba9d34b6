"""How the place of the centre of mass is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "center_of_mass",
    ContactFit(
        ranges=lambda s: [
            linear(axis, -0.7 * s.shape.depth, 0.7 * s.shape.depth, 0.1 * s.shape.depth, s.shape.depth)
            for axis in "xyz"
        ],
        starts=lambda s: [{"x": 0.0, "y": 0.0, "z": 0.0}],
        plausible=lambda s: dict.fromkeys("xyz", 0.03 * s.shape.depth),
        not_excited="the body hardly turns",
        excited_by="throws with a spin about each axis",
    ),
)
