"""How load dependent friction is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "load_dependent_friction",
    JointPatch(
        words="dry friction grows by {coefficient}·|motor torque|",
    ),
)
