"""What a controller's own loop may be wrong about, beside the drive: effects of the control computer and its sensor."""

from vision_s2r.effects import Effect, Parameter, Registry
from vision_s2r.joint import JOINT_EFFECTS

LOOP_EFFECTS: Registry[Effect] = Registry("control loop")


@LOOP_EFFECTS.register
class ObservationNoise(Effect):
    """Gaussian noise of the velocity that the controller sees, independent from sample to sample."""

    name = "observation_noise"
    source = "actuator"
    parameters = (Parameter("sigma", "rad/s", low=0.0, high=10.0, neutral=0.0, moderate=0.05),)


@LOOP_EFFECTS.register
class TimeStep(Effect):
    """The control period is this many times the one meant, all through an episode."""

    name = "time_step"
    source = "actuator"
    parameters = (Parameter("scale", "", low=0.1, high=10.0, neutral=1.0, moderate=1.3),)


# All that a controller is trained and tested under.
CONTROL_EFFECTS: Registry[Effect] = JOINT_EFFECTS | LOOP_EFFECTS
