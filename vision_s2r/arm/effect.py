"""The effects of an arm: those of its joints, each of one joint, and those of the whole."""

from vision_s2r.effects import Effect, Parameter, Registry
from vision_s2r.joint import JOINT_EFFECTS

PAYLOAD = "payload"
WHOLE: Registry[Effect] = Registry("arm")  # of no single joint


@WHOLE.register
class Payload(Effect):
    """A point mass on the last body, in its frame."""

    name = PAYLOAD
    source = "dynamics"
    parameters = (
        Parameter("mass", "kg", low=0.0, high=1e4, neutral=0.0, moderate=0.2),
        Parameter("x", "m", low=-10.0, high=10.0, neutral=None, moderate=0.0),
        Parameter("y", "m", low=-10.0, high=10.0, neutral=None, moderate=0.0),
        Parameter("z", "m", low=-10.0, high=10.0, neutral=None, moderate=0.0),
    )


ARM_EFFECTS = WHOLE | JOINT_EFFECTS
