"""URDF: the `<dynamics>` of a joint, viscous damping and Coulomb friction (the URDF specification's joint element)."""

from vision_s2r.patch.rigid import comment
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed

ATTRIBUTES = {"viscous_damping": "damping", "coulomb_friction": "friction"}


def joint(named: Diagnosed, recording: JointRecording) -> str:
    """XML to be merged into the `<joint>` of a robot description.

    An element that is there has both attributes, for one that is left out would mean 0: the nominal value where the
    diagnosis leaves it alone.
    """
    kind = "continuous" if recording.units == "rotary" else "prismatic"
    lines = ["<!-- Merge into your joint; write its name for JOINT. -->", f'<joint name="JOINT" type="{kind}">']
    if ATTRIBUTES.keys() & named.keys():
        values = {
            attribute: named[name]["value"].value if name in named else recording.nominal[name]
            for name, attribute in ATTRIBUTES.items()
        }
        lines += [f'  <dynamics damping="{values["damping"]:.9g}" friction="{values["friction"]:.9g}"/>']
    lines += comment(named, recording, set(ATTRIBUTES), "  ")
    return "\n".join([*lines, "</joint>"]) + "\n"
