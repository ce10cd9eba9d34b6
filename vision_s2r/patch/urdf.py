"""URDF: the `<dynamics>` of a joint, viscous damping and Coulomb friction (the URDF specification's joint element)."""

from vision_s2r.patch.effect import JOINT_PATCHES
from vision_s2r.patch.rigid import comment
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed


def joint(named: Diagnosed, recording: JointRecording) -> str:
    """XML to be merged into the `<joint>` of a robot description.

    An element that is there has both attributes, for one that is left out would mean 0: the nominal value where the
    diagnosis leaves it alone.
    """
    kind = "continuous" if recording.units == "rotary" else "prismatic"
    lines = ["<!-- Merge into your joint; write its name for JOINT. -->", f'<joint name="JOINT" type="{kind}">']
    attributes = {patch.urdf: name for name, patch in JOINT_PATCHES.items() if patch.urdf}
    written = set(attributes.values())
    if written & named.keys():
        found = {
            attribute: named[name]["value"].value if name in named else recording.nominal[name]
            for attribute, name in sorted(attributes.items())
        }
        text = "".join(f' {attribute}="{value:.9g}"' for attribute, value in found.items())
        lines += [f"  <dynamics{text}/>"]
    lines += comment(named, recording, written, "  ")
    return "\n".join([*lines, "</joint>"]) + "\n"
