"""How a contact that gives way is written for other simulators."""

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch

CONTACT_PATCHES.register(
    "contact_compliance",
    ContactPatch(
        bullet=lambda given, nominal: {
            "changeDynamics": {"contactStiffness": given["stiffness"], "contactDamping": given["damping"]}
        },
        urdf={"stiffness": "stiffness", "damping": "damping"},
        # solref's direct form takes both per mass of the body, negative
        mujoco_solref=lambda given, nominal: (
            -given["stiffness"] / nominal["mass"],
            -given["damping"] / nominal["mass"],
        ),
    ),
)
