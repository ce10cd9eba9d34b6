"""The encoder counts."""

import math

import numpy as np

from vision_s2r.effects import Parameter
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class EncoderQuantization(JointEffect):
    """Position rounded to multiples of the resolution, velocity its central difference (one-sided at the ends).

    A position servo sees it rounded too. With an offset its steps lie that much beside the multiples.
    """

    name = "encoder_quantization"
    source = "actuator"
    parameters = (
        Parameter("resolution", "rad", low=1e-9, high=1.0, neutral=0.0, moderate=0.01, scale="log"),
        Parameter("offset", "rad", low=-1.0, high=1.0, neutral=0.0, moderate=0.002, optional=True),
    )


@compiled
def rounded(position: float, resolution: float, offset: float = 0.0) -> float:
    """The position that the encoder shows."""
    return offset + resolution * math.floor((position - offset) / resolution + 0.5)


@compiled
def quantize(states: np.ndarray, resolution: float, sample_time: float, times: np.ndarray, offset: float = 0.0) -> None:
    """What the encoder shows of the states [T, 2], in place; at `times` [T], or every `sample_time` where empty."""
    length = len(states)
    for k in range(length):
        states[k, 0] = rounded(states[k, 0], resolution, offset)
    for k in range(length):
        before, after = max(k - 1, 0), min(k + 1, length - 1)
        if after > before:
            span = times[after] - times[before] if len(times) else (after - before) * sample_time
            states[k, 1] = (states[after, 0] - states[before, 0]) / span
