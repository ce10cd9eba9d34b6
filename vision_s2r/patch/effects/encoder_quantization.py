"""How encoder quantization is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "encoder_quantization",
    JointPatch(
        words="round the position that is read to {resolution} {length}",
    ),
)
