"""A body on its support in the formats of rigid bodies: PyBullet's changeDynamics, MuJoCo's geom, URDF's `<contact>`.

PyBullet multiplies the coefficients of the two that touch, and takes friction, rolling and spinning friction of body
and support together: these are for a body on a support whose lateralFriction and restitution are 1.
"""

import json
from collections.abc import Mapping
from typing import Any

from vision_s2r.contact import COEFFICIENTS, CONTACT_EFFECTS
from vision_s2r.patch.effect import CONTACT_PATCHES, ContactPatch, Given
from vision_s2r.recording import ContactRecording
from vision_s2r.report.reading import Diagnosed, ReportedParameter, values

SOLIMP = "0.99 0.9999 0.0001"  # impedance of a hard contact
Written = dict[str, tuple[ContactPatch, Given]]  # by effect: how it is written, and its parameters


def _written(named: Diagnosed, recording: ContactRecording) -> Written:
    """What was diagnosed, behind what the nominal coefficients are where they were not."""
    given = {name: {"value": recording.nominal[name]} for name in COEFFICIENTS} | values(named)
    return {name: (CONTACT_PATCHES[name], each) for name, each in given.items() if name in CONTACT_PATCHES}


def _comments(named: Diagnosed) -> list[str]:
    """Effects of other packages that no record says how to write."""
    return [f"  <!-- not expressed: {name} -->" for name in named if name not in CONTACT_PATCHES]


def bullet(named: Diagnosed, recording: ContactRecording) -> str:
    """JSON: by function of PyBullet its keyword arguments: `p.changeDynamics(body, -1, **patch["changeDynamics"])`."""
    patch: dict[str, dict[str, Any]] = {}
    for how, given in _written(named, recording).values():
        for function, arguments in how.bullet(given, recording.nominal).items():
            patch.setdefault(function, {}).update(arguments)
    missing = [name for name in named if name not in CONTACT_PATCHES]
    return json.dumps(patch | ({"not_expressed": missing} if missing else {}), indent=1) + "\n"


def urdf(named: Diagnosed, recording: ContactRecording) -> str:
    """XML to be merged into the `<link>` of the body; PyBullet reads its `<contact>`."""
    written = _written(named, recording).values()
    lines = ["<!-- Merge into the body's link; write its name for BODY. -->", '<link name="BODY">']
    lines += [f"  {how.urdf_link(given, recording.nominal)}" for how, given in written if how.urdf_link]
    elements = [(element, given[key]) for how, given in written for key, element in how.urdf.items()]
    lines += ["  <contact>", *(f'    <{element} value="{value:.9g}"/>' for element, value in elements), "  </contact>"]
    return "\n".join([*lines, *_comments(named), "</link>"]) + "\n"


def mujoco(named: Diagnosed, recording: ContactRecording) -> str:
    """XML to be merged into a model: friction, solref and solimp of the body's geom; gravity of a tilted support."""
    written = _written(named, recording)
    friction = ["0"] * 3
    for how, given in written.values():
        if how.mujoco_friction is not None:
            friction[how.mujoco_friction] = f"{given['value']:.6g}"
    # a geom has one solref: where an effect has one besides the coefficients', that is it
    solrefs = {
        name: how.mujoco_solref(given, recording.nominal) for name, (how, given) in written.items() if how.mujoco_solref
    }
    solref = next((each for name, each in solrefs.items() if name not in COEFFICIENTS), solrefs["restitution"])
    text = " ".join(f"{x:.6g}" for x in solref)
    geom = f'condim="6" friction="{" ".join(friction)}" solref="{text}" solimp="{SOLIMP}"'
    lines = ["<mujoco>", "  <!-- Merge into the body's geom, of a priority above its support's; its name for BODY. -->"]
    lines += [f'  <worldbody><body><geom name="BODY" priority="1" {geom}/></body></worldbody>']
    models = [how.mujoco_model(given, recording.nominal) for how, given in written.values() if how.mujoco_model]
    return "\n".join([*lines, *(f"  {model}" for model in models), *_comments(named), "</mujoco>"]) + "\n"


def hydra(named: Diagnosed, recording: ContactRecording, randomize: bool) -> str:
    """YAML of this project's own simulator: `nominal` with the diagnosed values in it, and `effects` besides."""

    def number(one: ReportedParameter) -> str:
        return f"[{one.low:.6g}, {one.high:.6g}]" if randomize else f"{one.value:.6g}"

    how = ", each value drawn from its 95 % interval" if randomize else ""
    lines = [f"# A body on its support as it was diagnosed{how}; SI units.", "nominal:"]
    for name in ("mass", *COEFFICIENTS, "gravity"):
        was: Mapping[str, ReportedParameter] | None = named.get(name)
        note = f"  # nominal was {recording.nominal[name]:.6g}" if was else ""
        lines += [f"  {name}: {number(was['value']) if was else f'{recording.nominal[name]:.6g}'}{note}"]
    others = {name: given for name, given in named.items() if name not in COEFFICIENTS}
    lines += ["effects:" if others else "effects: {}"]
    for name, given in others.items():
        lines += [f"  {name}:"]
        for parameter in CONTACT_EFFECTS[name].parameters:
            unit = f"  # {parameter.unit}" if parameter.unit else ""
            lines += [f"    {parameter.name}: {number(given[parameter.name])}{unit}"]
    return "\n".join(lines) + "\n"
