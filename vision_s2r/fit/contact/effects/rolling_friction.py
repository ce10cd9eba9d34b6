"""How friction against rolling is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "rolling_friction",
    ContactFit(
        ranges=lambda s: [linear("value", 0.0, s.shape.reach, 0.1 * s.shape.depth, 0.3 * s.shape.depth)],
        starts=lambda s: [{"value": x * s.shape.depth} for x in (0.004, 0.02, 0.1)],
        plausible=lambda s: {"value": 0.02 * s.shape.depth},
        not_excited="nothing rolls or rocks",
        excited_by="slow rolls and tumbles",
        along=("phase",),
        length=True,
    ),
)
