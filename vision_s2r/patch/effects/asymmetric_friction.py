"""How asymmetric friction is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "asymmetric_friction",
    JointPatch(
        words="viscous damping ±{viscous} and dry friction ±{coulomb} by the direction of motion",
    ),
)
