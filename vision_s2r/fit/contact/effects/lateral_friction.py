"""How sliding friction is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "lateral_friction",
    ContactFit(
        ranges=lambda s: [linear("value", 0.0, 3.0, 0.5, 1.0)],
        starts=lambda s: [{"value": max(s.nominal.lateral_friction, 0.05) * x} for x in (0.4, 0.75, 1.0, 1.5)],
        plausible=lambda s: {"value": 1.1 * s.nominal.lateral_friction + 0.02},
        not_excited="nothing slides",
        excited_by="pushes along the support",
        along=("phase",),
    ),
)
