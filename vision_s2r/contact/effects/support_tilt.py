"""The support is not level."""

import math

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class SupportTilt(ContactEffect):
    """In the support's frame gravity is R⊤·(0, 0, −g), R = R_y(pitch)·R_x(roll)."""

    name = "support_tilt"
    source = "contact"
    parameters = tuple(
        Parameter(angle, "rad", low=-1.0, high=1.0, neutral=0.0, moderate=0.03) for angle in ("roll", "pitch")
    )


@compiled
def tilted_gravity(gravity: float, roll: float, pitch: float) -> tuple[float, float, float]:
    """Acceleration of gravity in the support's frame."""
    across = gravity * math.cos(pitch)
    return gravity * math.sin(pitch), -across * math.sin(roll), -across * math.cos(roll)
