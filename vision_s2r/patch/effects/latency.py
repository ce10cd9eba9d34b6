"""How latency is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "latency",
    JointPatch(
        words="delay commands by {delay} s",
    ),
)
