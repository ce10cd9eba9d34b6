"""How a support that is not level is fitted."""

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit
from vision_s2r.fit.coordinates import linear

CONTACT_FITS.register(
    "support_tilt",
    ContactFit(
        ranges=lambda s: [linear(angle, -0.5, 0.5, 0.1, 0.3) for angle in ("roll", "pitch")],
        starts=lambda s: [{"roll": 0.0, "pitch": 0.0}],
        plausible=lambda s: {"roll": 0.01, "pitch": 0.01},
        not_excited="too little motion",
        excited_by="long slides in two directions",
    ),
)
