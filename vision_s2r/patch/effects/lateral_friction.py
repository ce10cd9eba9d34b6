"""How friction against sliding is written for other simulators."""

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch

CONTACT_PATCHES.register(
    "lateral_friction",
    ContactPatch(
        bullet=lambda given, nominal: {"changeDynamics": {"lateralFriction": given["value"]}},
        urdf={"value": "lateral_friction"},
        mujoco_friction=0,
    ),
)
