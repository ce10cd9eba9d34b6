"""How proportional gain is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "proportional_gain",
    JointPatch(
        words="the servo pulls {value} units of command a {length} of error",
    ),
)
