"""How friction against spinning on the spot is written for other simulators."""

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch

CONTACT_PATCHES.register(
    "spinning_friction",
    ContactPatch(
        bullet=lambda given, nominal: {"changeDynamics": {"spinningFriction": given["value"]}},
        urdf={"value": "spinning_friction"},
        mujoco_friction=1,
    ),
)
