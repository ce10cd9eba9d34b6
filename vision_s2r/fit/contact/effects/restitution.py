"""How the rebound of impacts is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "restitution",
    ContactFit(
        ranges=lambda s: [linear("value", 0.0, 1.0, 0.5, 0.5)],
        starts=lambda s: [{"value": x} for x in (s.nominal.restitution, 0.05, 0.15, 0.25, 0.4, 0.7)],
        plausible=lambda s: {"value": s.nominal.restitution + (0.05 if s.nominal.restitution < 0.5 else -0.05)},
        not_excited="nothing hits the support fast enough",
        excited_by="drops from a hand's height",
        along=("phase",),
    ),
)
