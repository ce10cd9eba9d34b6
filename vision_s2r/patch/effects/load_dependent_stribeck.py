"""How load dependent stribeck is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "load_dependent_stribeck",
    JointPatch(
        words="dry friction grows by {coefficient}·|motor torque|·exp(−(velocity/{velocity})²)",
    ),
)
