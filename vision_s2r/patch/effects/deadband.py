"""How deadband is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "deadband",
    JointPatch(
        words="the servo gives no torque within ±{width}/2 {length} of its target",
    ),
)
