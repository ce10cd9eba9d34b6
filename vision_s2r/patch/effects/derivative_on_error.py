"""How a servo's derivative on its error is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "derivative_on_error",
    JointPatch(
        words="the servo adds {gain} units a {length}/s of its error's rate, low-passed by {time_constant} s",
    ),
)
