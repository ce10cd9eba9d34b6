"""How derivative gain is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "derivative_gain",
    JointPatch(
        words="the servo brakes {value} units of command a {length}/s",
    ),
)
