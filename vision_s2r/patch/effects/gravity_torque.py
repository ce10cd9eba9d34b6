"""How gravity torque is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "gravity_torque",
    JointPatch(
        words="place the load's centre of mass so that it weighs {value} {torque} at ±90°",
    ),
)
