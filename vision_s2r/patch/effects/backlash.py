"""How backlash is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "backlash",
    JointPatch(
        words="a second joint in series, free within ±{width}/2 {length}, half of the inertia on either side",
    ),
)
