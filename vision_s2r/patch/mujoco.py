"""MuJoCo: attributes of a joint and of its motor (MuJoCo's XML reference: body/joint, actuator/general)."""

from vision_s2r.patch.rigid import comment
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed


def joint(named: Diagnosed, recording: JointRecording) -> str:
    """XML to be merged into a model: `<joint>` and, where the drive is concerned, `<general>`. Angles in radians."""
    attributes: dict[str, float | str] = {}
    for name, attribute in (("viscous_damping", "damping"), ("coulomb_friction", "frictionloss")):
        if name in named:
            attributes[attribute] = named[name]["value"].value
    expressed = {"viscous_damping", "coulomb_friction"}
    notes: list[str] = []
    if "inertia" in named:
        more = named["inertia"]["value"].value - recording.nominal["inertia"]
        if more > 0:  # a rotor's inertia cannot be negative
            attributes["armature"] = more
            expressed.add("inertia")
            notes.append("armature is what the diagnosis adds to the inertia; add it to an armature that is there")
    drive, of_drive = _drive(named, recording)
    kind = "hinge" if recording.units == "rotary" else "slide"
    lines = ["<mujoco>", "  <!-- Merge into the joint of your model; write its name for JOINT. -->"]
    lines += [f"  <!-- {note} -->" for note in notes]
    lines += [f'  <worldbody><body><joint name="JOINT" type="{kind}"{_text(attributes)}/></body></worldbody>']
    if drive:
        lines += [f'  <actuator><general name="MOTOR" joint="JOINT"{_text(drive)}/></actuator>']
    lines += comment(named, recording, expressed | of_drive, "  ")
    return "\n".join([*lines, "</mujoco>"]) + "\n"


def _drive(named: Diagnosed, recording: JointRecording) -> tuple[dict[str, float | str], set[str]]:
    """Attributes of the motor: force = gainprm·ctrl + biasprm, ctrl the command, clamped to ctrlrange."""
    expressed = {"torque_constant", "bias_torque", "torque_saturation"} & named.keys()
    if not expressed:
        return {}, expressed
    constant = recording.nominal["torque_constant"]
    if "torque_constant" in named:
        constant = named["torque_constant"]["value"].value
    drive: dict[str, float | str] = {"gaintype": "fixed", "gainprm": constant}
    if "bias_torque" in named:
        drive |= {"biastype": "affine", "biasprm": f"{-named['bias_torque']['value'].value:.9g} 0 0"}
    if "torque_saturation" in named:
        limit = named["torque_saturation"]["limit"].value / constant
        drive |= {"ctrllimited": "true", "ctrlrange": f"{-limit:.9g} {limit:.9g}"}
    return drive, expressed


def _text(attributes: dict[str, float | str]) -> str:
    return "".join(
        f' {name}="{value if isinstance(value, str) else f"{value:.9g}"}"' for name, value in attributes.items()
    )
