"""How cogging is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "cogging",
    JointPatch(
        words="apply {amplitude}·sin({teeth}·position)",
    ),
)
