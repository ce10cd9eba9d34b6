"""How round corners are written for other simulators: none has an argument for them, the shape has to be another."""

from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch, Given


def _words(given: Given, nominal: Given) -> str:
    return f"<!-- its edges and corners have a radius of {given['value']:.6g} m: collide with a mesh that has it -->"


CONTACT_PATCHES.register(
    "corner_radius",
    ContactPatch(
        bullet=lambda given, nominal: {"shape": {"corner_radius": given["value"]}},
        urdf_link=_words,
        mujoco_model=_words,
    ),
)
