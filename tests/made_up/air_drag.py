"""A joint effect of another package: a fan on the shaft. Everything about it is in this file."""

import numpy as np

from vision_s2r.effects import Parameter
from vision_s2r.fit.coordinates import ParameterRange, linear
from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit
from vision_s2r.joint.compiled import compiled
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect
from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch


@compiled
def drag(position: float, velocity: float, time: float, coefficient: float) -> float:
    return -coefficient * abs(velocity) * velocity


@JOINT_EFFECTS.register
class AirDrag(JointEffect):
    """− coefficient·|θ̇|·θ̇ on the motor."""

    name = "air_drag"
    source = "actuator"
    parameters = (Parameter("coefficient", "N·m·s²/rad²", low=0.0, high=1e3, neutral=0.0, moderate=0.01),)
    motor_torque = staticmethod(drag)
    of_velocity = True


def ranges(track, noise: float) -> list[ParameterRange]:
    size = track.scales.torque / track.scales.speed**2
    return [linear("coefficient", 0.0, 20 * size, size)]


def starts(track, row, residuals: np.ndarray) -> list[dict[str, float]]:
    return [{"coefficient": x * track.scales.torque / track.scales.speed**2} for x in (0.03, 0.1, 0.3)]


def plausible(track, row) -> dict[str, float]:
    return {"coefficient": 0.1 * track.scales.peak_torque / track.scales.peak_speed**2}


JOINT_FITS.register(
    "air_drag",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        not_excited="too little speed",
        excited_by="motion at several high speeds",
        confusable=frozenset({"viscous_damping"}),
    ),
)

JOINT_PATCHES.register("air_drag", JointPatch(words="apply −{coefficient}·|velocity|·velocity"))
