"""How friction against spinning is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "spinning_friction",
    ContactFit(
        ranges=lambda s: [linear("value", 0.0, s.shape.reach, 0.2 * s.shape.depth, 0.5 * s.shape.depth)],
        starts=lambda s: [{"value": x * s.shape.depth} for x in (0.01, 0.05, 0.2)],
        plausible=lambda s: {"value": 0.05 * s.shape.depth},
        not_excited="nothing spins on the support",
        excited_by="spins on the spot",
        along=("spin",),
    ),
)
