"""The encoder's zero is not where the simulator has it."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class PositionOffset(JointEffect):
    """The encoder shows θ + value, to the log and to a servo; it is seen through gravity only.

    Positions of this room are those that the encoder shows, so gravity is where it acts.
    """

    name = "position_offset"
    source = "dynamics"
    parameters = (Parameter("value", "rad", low=-1e6, high=1e6, neutral=None, moderate=0.3),)
