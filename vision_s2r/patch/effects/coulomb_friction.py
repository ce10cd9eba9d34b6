"""How coulomb friction is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "coulomb_friction",
    JointPatch(
        words="dry friction of {value} {torque}",
        urdf="friction",
        mujoco_joint=lambda given, nominal: {"frictionloss": given["value"]},
        # A velocity motor with target 0 and a limited force; control mode 0 is VELOCITY_CONTROL.
        bullet=lambda given: {
            "setJointMotorControl2": {"controlMode": 0, "targetVelocity": 0.0, "force": given["value"]}
        },
    ),
)
