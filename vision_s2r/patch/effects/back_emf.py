"""How a motor's back-EMF is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "back_emf",
    JointPatch(
        words="take {value} {torque}·s/{length} times the motor's speed off its torque while the drive is on",
    ),
)
