"""How friction that grows with the torque on the load is fitted: as that under the motor's torque is."""

from vision_s2r.fit.joint.effect import JOINT_FITS, JointFit
from vision_s2r.fit.joint.effects.load_dependent_friction import plausible, ranges, starts

JOINT_FITS.register(
    "external_load_friction",
    JointFit(
        ranges=ranges,
        starts=starts,
        plausible=plausible,
        confusable=frozenset({"coulomb_friction", "load_dependent_friction"}),
        not_excited="no weight or pull on the load, or the same one throughout",
        excited_by="a heavy and a light load at like speed",
        along=("position",),
    ),
)
