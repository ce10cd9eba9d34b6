"""How a centre of mass that is off is written for other simulators."""

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch, Given


def _xyz(given: Given) -> str:
    return " ".join(f"{given[axis]:.9g}" for axis in "xyz")


CONTACT_PATCHES.register(
    "center_of_mass",
    ContactPatch(
        bullet=lambda given, nominal: {
            "createMultiBody": {"baseInertialFramePosition": [given[axis] for axis in "xyz"]}
        },
        urdf_link=lambda given, nominal: f'<inertial><origin xyz="{_xyz(given)}"/></inertial>',
        mujoco_model=lambda given, nominal: f'<!-- the body\'s inertial frame: pos="{_xyz(given)}" -->',
    ),
)
