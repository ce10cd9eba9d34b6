"""What the formats for rigid bodies have in common: what none of them has an attribute for, and what to do then."""

from vision_s2r.effects import summary
from vision_s2r.joint import JOINT_EFFECTS
from vision_s2r.patch import effects as _effects  # noqa: F401  (fills JOINT_PATCHES)
from vision_s2r.patch.effect import JOINT_PATCHES
from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed, values


def advice(named: Diagnosed, recording: JointRecording) -> dict[str, str]:
    """By diagnosed effect, how to bring it into a simulator whose joints do not know it; values in SI units.

    Of an effect without words for it, its definition.
    """
    length, torque = ("rad", "N·m") if recording.units == "rotary" else ("m", "N")
    found: dict[str, str] = {}
    for name, given in values(named).items():
        if name not in JOINT_PATCHES:
            found[name] = f"{summary(JOINT_EFFECTS[name])} ({', '.join(f'{key} {x:.6g}' for key, x in given.items())})"
            continue
        words = {key: f"{value:.6g}" for key, value in given.items()}
        if name in recording.nominal:
            words["change"] = f"{given['value'] - recording.nominal[name]:+.6g}"
            words["opposite"] = f"{-given['value']:.6g}"
        found[name] = JOINT_PATCHES[name].words.format(**words, length=length, torque=torque)
    return found


def comment(named: Diagnosed, recording: JointRecording, expressed: set[str], indent: str = "") -> list[str]:
    """XML comments: what of the diagnosis the format has no attribute for."""
    lines = [f"{name}: {text}" for name, text in advice(named, recording).items() if name not in expressed]
    # "--" may not stand in a comment of XML
    return [f"{indent}<!-- no attribute for {line.replace('--', '- -')} -->" for line in lines]
