"""How springs in the contact are fitted."""

import math

from vision_s2r.fit.contact.effect import CONTACT_FITS, ContactFit, ContactScales
from vision_s2r.fit.coordinates import ParameterRange, Setting, log

STIFFNESSES = (0.15, 0.3, 0.45, 0.6, 0.75, 0.88)  # starts: between soft and hard …
RATIOS = (0.1, 0.4)  # … and of critical damping
PLAUSIBLE = 0.65


def soft(s: ContactScales) -> float:
    """Stiffness (N/m) of a point into which a body sinks by half of its depth."""
    return s.nominal.mass * s.nominal.gravity / (0.5 * s.shape.depth)


def hard(s: ContactScales) -> float:
    """Stiffness (N/m) of a point whose impacts last a tenth of a sample."""
    return 0.25 * s.nominal.mass * (10 * math.pi / s.sample_time) ** 2


def spring(s: ContactScales, place: float, ratio: float) -> Setting:
    """A spring at a place from soft (0) to hard (1), with a share of its critical damping."""
    stiffness = soft(s) * (hard(s) / soft(s)) ** place
    return {"stiffness": stiffness, "damping": ratio * math.sqrt(stiffness * s.nominal.mass)}


def ranges(s: ContactScales) -> list[ParameterRange]:
    """What the fit moves."""
    middle = spring(s, 0.5, 1.0)["damping"]
    return [log("stiffness", soft(s), hard(s), 0.02), log("damping", 1e-3 * middle, 1e2 * middle, 0.03, 3.0)]


def valley(s: ContactScales) -> list[tuple[float, ...]]:
    """A rebound tells the share of the critical damping surely, the stiffness, which moves both, less so."""
    stiffer = 0.15 * math.log(hard(s) / soft(s))
    return [(0.0, math.log(4)), (stiffer, 0.5 * stiffer)]


CONTACT_FITS.register(
    "contact_compliance",
    ContactFit(
        ranges=ranges,
        starts=lambda s: [spring(s, place, ratio) for place in STIFFNESSES for ratio in RATIOS],
        valley=valley,
        plausible=lambda s: spring(s, PLAUSIBLE, 0.3),
        not_excited="no impact lasts long enough to show it",
        excited_by="harder impacts, sampled faster",
        along=("phase",),
        confusable=frozenset({"restitution"}),
        rough=True,
    ),
)
