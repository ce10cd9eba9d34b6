"""A body on its support in the formats of rigid bodies: PyBullet's changeDynamics, MuJoCo's geom, URDF's `<contact>`.

PyBullet multiplies the coefficients of the two that touch, and takes friction, rolling and spinning friction of body
and support together: these are for a body on a support whose lateralFriction and restitution are 1.
"""

import json
import math
from collections.abc import Mapping

from vision_s2r.contact import COEFFICIENTS, CONTACT_EFFECTS
from vision_s2r.recording import ContactRecording
from vision_s2r.report.reading import Diagnosed, ReportedParameter

PYBULLET = {
    ("lateral_friction", "value"): "lateralFriction",
    ("restitution", "value"): "restitution",
    ("rolling_friction", "value"): "rollingFriction",
    ("spinning_friction", "value"): "spinningFriction",
    ("contact_compliance", "stiffness"): "contactStiffness",
    ("contact_compliance", "damping"): "contactDamping",
}
URDF = {
    ("lateral_friction", "value"): "lateral_friction",
    ("restitution", "value"): "restitution",
    ("rolling_friction", "value"): "rolling_friction",
    ("spinning_friction", "value"): "spinning_friction",
    ("contact_compliance", "stiffness"): "stiffness",
    ("contact_compliance", "damping"): "damping",
}
HARD = 0.004  # s: MuJoCo's time constant of a rigid contact, twice its usual step
SOLIMP = "0.99 0.9999 0.0001"  # impedance of a hard contact


def _values(named: Diagnosed, recording: ContactRecording) -> dict[tuple[str, str], float]:
    """Both nominal coefficients, and what was diagnosed."""
    values = {(name, "value"): recording.nominal[name] for name in COEFFICIENTS}
    return values | {(name, key): one.value for name, given in named.items() for key, one in given.items()}


def gravity(named: Diagnosed, recording: ContactRecording) -> tuple[float, float, float]:
    """Gravity (m/s²) in the frame of the support."""
    g = recording.nominal["gravity"]
    tilt = named.get("support_tilt")
    if tilt is None:
        return 0.0, 0.0, -g
    roll, pitch = tilt["roll"].value, tilt["pitch"].value
    return g * math.sin(pitch), -g * math.cos(pitch) * math.sin(roll), -g * math.cos(pitch) * math.cos(roll)


def bullet(named: Diagnosed, recording: ContactRecording) -> str:
    """JSON: by function of PyBullet its keyword arguments: `p.changeDynamics(body, -1, **patch["changeDynamics"])`."""
    values = _values(named, recording)
    patch: dict[str, object] = {"changeDynamics": {PYBULLET[key]: values[key] for key in values if key in PYBULLET}}
    if "support_tilt" in named:
        patch["setGravity"] = dict(zip(("gravX", "gravY", "gravZ"), gravity(named, recording), strict=True))
    if "center_of_mass" in named:
        offset = [named["center_of_mass"][axis].value for axis in "xyz"]
        patch["createMultiBody"] = {"baseInertialFramePosition": offset}
    if "corner_radius" in named:  # no argument: the shape has to be another
        patch["shape"] = {"corner_radius": values["corner_radius", "value"]}
    return json.dumps(patch, indent=1) + "\n"


def urdf(named: Diagnosed, recording: ContactRecording) -> str:
    """XML to be merged into the `<link>` of the body; PyBullet reads its `<contact>`."""
    values = _values(named, recording)
    lines = ["<!-- Merge into the body's link; write its name for BODY. -->", '<link name="BODY">']
    if "center_of_mass" in named:
        xyz = " ".join(f"{named['center_of_mass'][axis].value:.9g}" for axis in "xyz")
        lines += [f'  <inertial><origin xyz="{xyz}"/></inertial>']
    lines += [f"  {_rounded(named)}"] if "corner_radius" in named else []
    lines += ["  <contact>"]
    lines += [f'    <{URDF[key]} value="{values[key]:.9g}"/>' for key in values if key in URDF]
    lines += ["  </contact>", *_of_world(named, recording), "</link>"]
    return "\n".join(lines) + "\n"


def mujoco(named: Diagnosed, recording: ContactRecording) -> str:
    """XML to be merged into a model: friction, solref and solimp of the body's geom; gravity where the support tilts.

    MuJoCo has no restitution: a damping ratio ζ of which exp(−πζ/√(1−ζ²)) rebounds comes nearest. A spring's stiffness
    and damping are given per mass of the body, as solref's direct form takes them.
    """
    values = _values(named, recording)
    friction = [
        values.get((name, "value"), 0.0) for name in ("lateral_friction", "spinning_friction", "rolling_friction")
    ]
    if "contact_compliance" in named:
        mass = recording.nominal["mass"]
        stiffness, damping = (values["contact_compliance", key] / mass for key in ("stiffness", "damping"))
        solref = f"{-stiffness:.6g} {-damping:.6g}"
    else:
        rebound = min(max(values["restitution", "value"], 1e-3), 0.999)
        ratio = -math.log(rebound) / math.hypot(math.pi, math.log(rebound))
        solref = f"{HARD} {ratio:.6g}"
    geom = f'condim="6" friction="{" ".join(f"{x:.6g}" for x in friction)}" solref="{solref}" solimp="{SOLIMP}"'
    lines = ["<mujoco>", "  <!-- Merge into the body's geom, of a priority above its support's; its name for BODY. -->"]
    if "support_tilt" in named:
        lines += [f'  <option gravity="{" ".join(f"{x:.9g}" for x in gravity(named, recording))}"/>']
    lines += [f'  <worldbody><body><geom name="BODY" priority="1" {geom}/></body></worldbody>']
    if "center_of_mass" in named:
        xyz = " ".join(f"{named['center_of_mass'][axis].value:.9g}" for axis in "xyz")
        lines += [f'  <!-- the body\'s inertial frame: pos="{xyz}" -->']
    lines += [f"  {_rounded(named)}"] if "corner_radius" in named else []
    return "\n".join([*lines, "</mujoco>"]) + "\n"


def _rounded(named: Diagnosed) -> str:
    radius = named["corner_radius"]["value"].value
    return f"<!-- its edges and corners have a radius of {radius:.6g} m: collide with a mesh that has it -->"


def _of_world(named: Diagnosed, recording: ContactRecording) -> list[str]:
    """What belongs to the world and not to the link."""
    if "support_tilt" not in named:
        return []
    return [f"  <!-- gravity in the support's frame: {' '.join(f'{x:.9g}' for x in gravity(named, recording))} -->"]


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
