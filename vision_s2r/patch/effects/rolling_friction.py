"""How friction against rolling is written for other simulators."""

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch

CONTACT_PATCHES.register(
    "rolling_friction",
    ContactPatch(
        bullet=lambda given, nominal: {"changeDynamics": {"rollingFriction": given["value"]}},
        urdf={"value": "rolling_friction"},
        mujoco_friction=2,
    ),
)
