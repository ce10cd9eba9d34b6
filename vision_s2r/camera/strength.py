"""How strong an effect is: 0 none, 1 its moderate setting; between and beyond, on each parameter's own scale."""

import math
from collections.abc import Mapping

from vision_s2r.effects import Effect, Parameter


def at(effect: Effect, strength: float) -> dict[str, float]:
    """The effect's parameters at a strength above 0, within their bounds."""
    return {parameter.name: _value(parameter, strength) for parameter in effect.parameters}


def strength_of(effect: Effect, values: Mapping[str, float]) -> float:
    """The strength at which the strongest of the effect's parameters is as far from neutral as in `values`."""
    return max(_strength(parameter, values[parameter.name]) for parameter in effect.parameters)


def _value(parameter: Parameter, strength: float) -> float:
    neutral, moderate = parameter.neutral, parameter.moderate
    if neutral is None:  # a direction, a place: it has no strength
        return moderate
    if math.isinf(neutral):  # the less the stronger: electrons, quality
        value = moderate / strength
    elif parameter.scale == "log":
        value = neutral * (moderate / neutral) ** strength
    else:
        value = neutral + strength * (moderate - neutral)
    return min(max(value, parameter.low), parameter.high)


def _strength(parameter: Parameter, value: float) -> float:
    """The inverse, whatever the direction."""
    neutral, moderate = parameter.neutral, parameter.moderate
    if neutral is None:
        return 0.0
    if math.isinf(neutral):
        return moderate / value
    if parameter.scale == "log":
        return abs(math.log(value / neutral) / math.log(moderate / neutral))
    return abs((value - neutral) / (moderate - neutral))
