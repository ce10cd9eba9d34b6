"""How a support that is not level is written for other simulators: as gravity in its frame."""

from vision_s2r.contact.effects.support_tilt import tilted_gravity
from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch, Given


def _gravity(given: Given, nominal: Given) -> tuple[float, float, float]:
    x, y, z = tilted_gravity.py_func(nominal["gravity"], given["roll"], given["pitch"])
    return x, y, z


def _text(given: Given, nominal: Given) -> str:
    return " ".join(f"{component:.9g}" for component in _gravity(given, nominal))


CONTACT_PATCHES.register(
    "support_tilt",
    ContactPatch(
        bullet=lambda given, nominal: {
            "setGravity": dict(zip(("gravX", "gravY", "gravZ"), _gravity(given, nominal), strict=True))
        },
        urdf_link=lambda given, nominal: f"<!-- gravity in the support's frame: {_text(given, nominal)} -->",
        mujoco_model=lambda given, nominal: f'<option gravity="{_text(given, nominal)}"/>',
    ),
)
