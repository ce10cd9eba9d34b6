"""How compliance is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "compliance",
    JointPatch(
        words="a second joint in series, a spring of {stiffness} with damping {damping}, "
        "half of the inertia on either side",
    ),
)
