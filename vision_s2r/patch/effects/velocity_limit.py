"""How velocity limit is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "velocity_limit",
    JointPatch(
        words="let targets move by {value} {length}/s at most",
    ),
)
