"""How position offset is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "position_offset",
    JointPatch(
        words="the position that is read is the joint's plus {value} {length}",
    ),
)
