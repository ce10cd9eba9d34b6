"""How restitution is written for other simulators."""

import math

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch, Given

HARD = 0.004  # s: MuJoCo's time constant of a rigid contact, twice its usual step


def _solref(given: Given, nominal: Given) -> tuple[float, float]:
    """MuJoCo has no restitution: a damping ratio ζ of which exp(−πζ/√(1−ζ²)) rebounds comes nearest."""
    rebound = math.log(min(max(given["value"], 1e-3), 0.999))
    return HARD, -rebound / math.hypot(math.pi, rebound)


CONTACT_PATCHES.register(
    "restitution",
    ContactPatch(
        bullet=lambda given, nominal: {"changeDynamics": {"restitution": given["value"]}},
        urdf={"value": "restitution"},
        mujoco_solref=_solref,
    ),
)
