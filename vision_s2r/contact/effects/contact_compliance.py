"""Body or support gives way: an impact lasts."""

import math

from vision_s2r.contact.effect import CONTACT_EFFECTS, ContactEffect
from vision_s2r.contact.lanes import Lanes
from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled


@CONTACT_EFFECTS.register
class ContactCompliance(ContactEffect):
    """Every point of contact is a spring of `stiffness` with `damping` that pushes and never pulls.

    As PyBullet's contactStiffness and contactDamping at a fine step. There, restitution e adds to a spring's damping
    while a point approaches: the force is stiffness·depth + (1 + e)·damping·approach.
    """

    name = "contact_compliance"
    source = "contact"
    parameters = (
        Parameter("stiffness", "N/m", low=1.0, high=1e9, neutral=math.inf, moderate=2e4, scale="log"),
        Parameter("damping", "N·s/m", low=0.0, high=1e6, neutral=None, moderate=10.0),
    )


@compiled
def spring_impulse(
    so_far: Lanes, depth: Lanes, speeds: tuple[Lanes, Lanes], mobility: Lanes, spring: tuple[Lanes, Lanes], step: Lanes
) -> Lanes:
    """The impulse of a step of a point's spring, one iteration on from what it is `so_far`.

    speeds: normal velocities of the point before the step and now, with all impulses so far; mobility: change of the
    latter by a unit impulse; spring: stiffness and damping, while approaching times 1 + e. Damping acts on the mean.
    """
    stiffness, damping = spring
    wanted = step * (stiffness * depth - 0.5 * damping * (speeds[0] + speeds[1]))
    return max(0.0, so_far + (wanted - so_far) / (1 + 0.5 * step * damping * mobility))
