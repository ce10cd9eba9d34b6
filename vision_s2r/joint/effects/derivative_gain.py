"""A position servo damps more or less than believed."""

from vision_s2r.effects import Parameter
from vision_s2r.joint.effect import JOINT_EFFECTS, JointEffect


@JOINT_EFFECTS.register
class DerivativeGain(JointEffect):
    """K_d of a servo's u = clip(K_p·(target − θ) − K_d·θ̇, ±limit), in units of u; θ̇ is the load's, unrounded.

    Where u never reaches its limit it is degenerate with viscous damping. The law's formula is beside K_p's.
    """

    name = "derivative_gain"
    source = "dynamics"
    servo = True
    parameters = (Parameter("value", "s/rad", low=0.0, high=1e6, neutral=None, moderate=0.2),)
