"""How bias torque is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "bias_torque",
    JointPatch(
        words="apply a constant {opposite} {torque}",
        mujoco_motor=lambda given, constant: {"biastype": "affine", "biasprm": f"{-given['value']:.9g} 0 0"},
    ),
)
