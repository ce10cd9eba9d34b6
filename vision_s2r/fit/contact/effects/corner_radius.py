"""How the radius of corners is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "corner_radius",
    ContactFit(
        ranges=lambda s: [linear("value", 0.0, 0.9 * s.shape.depth, 0.1 * s.shape.depth, 0.3 * s.shape.depth)],
        starts=lambda s: [{"value": x * s.shape.depth} for x in (0.006, 0.03, 0.15)],
        plausible=lambda s: {"value": 0.05 * s.shape.depth},
        not_excited="no corner or edge comes down",
        excited_by="throws with a spin, that land on corners and edges",
        along=("part", "phase"),
    ),
)
