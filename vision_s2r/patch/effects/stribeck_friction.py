"""How stribeck friction is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "stribeck_friction",
    JointPatch(
        words="dry friction of {static} {torque} at rest, falling to the Coulomb value as exp(−(velocity/{velocity})²)",
    ),
)
