"""MuJoCo: attributes of a joint and of its motor (MuJoCo's XML reference: body/joint, actuator/general)."""

from vision_s2r.patch.effect import JOINT_PATCHES
from vision_s2r.patch.rigid import comment
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed, values


def joint(named: Diagnosed, recording: JointRecording) -> str:
    """XML to be merged into a model: `<joint>` and, where the drive is concerned, `<general>`. Angles in radians."""
    attributes: dict[str, float | str] = {}
    expressed: set[str] = set()
    notes: list[str] = []
    for name, given in values(named).items():
        write = JOINT_PATCHES[name].mujoco_joint if name in JOINT_PATCHES else None
        if write and (found := write(given, recording.nominal)):
            attributes |= found
            expressed.add(name)
            notes += [note] if (note := JOINT_PATCHES[name].mujoco_note) else []
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
    given = values(named)
    writers = {name: JOINT_PATCHES[name].mujoco_motor for name in given if name in JOINT_PATCHES}
    constant = given.get("torque_constant", {}).get("value", recording.nominal["torque_constant"])
    drive: dict[str, float | str] = {"gaintype": "fixed", "gainprm": constant}
    expressed = set()
    for name, write in writers.items():
        if write:
            drive |= write(given[name], constant)
            expressed.add(name)
    return (drive if expressed else {}), expressed


def _text(attributes: dict[str, float | str]) -> str:
    return "".join(
        f' {name}="{value if isinstance(value, str) else f"{value:.9g}"}"' for name, value in attributes.items()
    )
