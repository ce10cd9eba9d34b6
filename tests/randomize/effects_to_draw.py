"""Effects of every kind that there is to draw: with and without a neutral value, on both scales."""

import math

from vision_s2r.effects import Effect, Parameter, Registry

EFFECTS: Registry[Effect] = Registry("toy")


@EFFECTS.register
class Damping(Effect):
    name = "damping"
    source = "dynamics"
    parameters = (Parameter("value", "N·m·s/rad", low=0.0, high=10.0, neutral=None, moderate=0.1),)


@EFFECTS.register
class Play(Effect):
    name = "play"
    source = "actuator"
    parameters = (Parameter("width", "rad", low=1e-6, high=1.0, neutral=0.0, moderate=0.01, scale="log"),)


@EFFECTS.register
class Spring(Effect):
    name = "spring"
    source = "actuator"
    parameters = (
        Parameter("stiffness", "N·m/rad", low=1.0, high=1e4, neutral=math.inf, moderate=50.0, scale="log"),
        Parameter("loss", "N·m·s/rad", low=0.0, high=10.0, neutral=None, moderate=0.1),
    )


@EFFECTS.register
class Tone(Effect):
    name = "tone"
    source = "camera"
    parameters = (Parameter("gamma", "", low=0.25, high=4.0, neutral=1.0, moderate=1.5, scale="log"),)
