"""How viscous damping is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "viscous_damping",
    JointPatch(
        words="−{value}·velocity against the motion",
        urdf="damping",
        mujoco_joint=lambda given, nominal: {"damping": given["value"]},
        bullet=lambda given: {"changeDynamics": {"jointDamping": given["value"]}},
    ),
)
