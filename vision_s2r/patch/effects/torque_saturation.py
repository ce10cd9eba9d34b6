"""How torque saturation is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "torque_saturation",
    JointPatch(
        words="clip the motor torque to ±{limit} {torque}",
        mujoco_motor=lambda given, constant: {
            "ctrllimited": "true",
            "ctrlrange": f"{-given['limit'] / constant:.9g} {given['limit'] / constant:.9g}",
        },
    ),
)
