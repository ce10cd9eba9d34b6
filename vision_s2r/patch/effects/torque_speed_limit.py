"""How torque speed limit is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "torque_speed_limit",
    JointPatch(
        words="limit the motor torque to {stall}·(1 − |velocity|/{no_load_speed}) with the motion, {stall} against it",
    ),
)
