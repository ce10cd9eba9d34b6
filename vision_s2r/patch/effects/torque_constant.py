"""How torque constant is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "torque_constant",
    JointPatch(
        words="{value} {torque} a unit of command",
        mujoco_motor=lambda given, constant: {"gainprm": given["value"]},
    ),
)
