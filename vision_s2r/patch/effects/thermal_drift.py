"""How thermal drift is written for other simulators."""

from vision_s2r.patch.effect import JOINT_PATCHES, JointPatch

JOINT_PATCHES.register(
    "thermal_drift",
    JointPatch(
        words="let viscous damping grow by the factor 1 + {rate}·t",
    ),
)
