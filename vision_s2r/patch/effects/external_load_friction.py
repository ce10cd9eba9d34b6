"""How friction under the load is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "external_load_friction",
    JointPatch(
        words="dry friction grows by {coefficient}·|torque on the load|",
    ),
)
