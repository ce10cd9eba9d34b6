"""How acceleration limit is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "acceleration_limit",
    JointPatch(
        words="let the rate of targets change by {value} {length}/s² at most",
    ),
)
