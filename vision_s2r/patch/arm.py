"""The model of an arm with what was found in it, as MJCF (MuJoCo's XML reference: body/joint, actuator/general)."""

import math

import mujoco

from vision_s2r.arm.effect import ARM_EFFECTS, BASE_TILT, OFFSET, PAYLOAD, tilted
from vision_s2r.arm.model import CARRIED, ArmModel
from vision_s2r.effects import summary
from vision_s2r.fit.arm.free_run import effects_of
from vision_s2r.fit.case import Values
from vision_s2r.patch.hydra import number
from vision_s2r.recording import ArmRecording, JointRecording
from vision_s2r.report.reading import Diagnosed, values

# By effect, the name of the nominal value that it replaces, which the format has an attribute for.
EXPRESSED = {
    "inertia": "inertia",
    "viscous_damping": "viscous_damping",
    "coulomb_friction": "coulomb_friction",
    "proportional_gain": "proportional_gain",
    "derivative_gain": "derivative_gain",
}

FINE = 2.5e-4  # s, of the shortest steps that a delay's memory is long enough for


def mjcf(named: Diagnosed, recording: ArmRecording) -> str:
    """The model with each logged joint's drive as the diagnosis has it, its servo an actuator of the joint's name.

    Angles in radians. What MuJoCo has no attribute for is listed in comments at the top. An actuator with a delay hears
    0 until its first command arrives, where `mj_initCtrlHistory` does not say otherwise.
    """
    found = values(named)
    model = ArmModel(recording.model)
    spec, left = model.spec, []
    spec.modelname = spec.modelname or "arm"
    for name, joint in recording.joints.items():
        left += [f"{name}: {each}" for each in _drive(spec, name, joint, effects_of(name, found))]
    if PAYLOAD in found:
        given = found[PAYLOAD]
        spec.body(model.body_of(recording.tip, list(recording.joints))).add_body(
            name=CARRIED,
            pos=[given["x"], given["y"], given["z"]],
            mass=given["mass"],
            ipos=[0.0, 0.0, 0.0],
            inertia=[1e-9] * 3,
            explicitinertial=True,
        )
    if BASE_TILT in found:
        spec.option.gravity = tilted(spec.option.gravity, **found[BASE_TILT])
    if spec.meshes:
        spec.meshdir = str((recording.model.parent / spec.meshdir).resolve())
    spec.compile()
    first, _, rest = spec.to_xml().partition("\n")
    # "--" may not stand in a comment of XML
    notes = "".join(f"  <!-- no attribute for {line.replace('--', '- -')} -->\n" for line in left)
    return f"{first}\n{notes}{rest}"


def _drive(spec: mujoco.MjSpec, name: str, recording: JointRecording, found: Values) -> list[str]:
    """Write a joint's drive; returns what could not be written."""
    nominal = dict(recording.nominal)
    nominal |= {EXPRESSED[each]: given["value"] for each, given in found.items() if each in EXPRESSED}
    limit = nominal.get("command_limit")
    if "torque_saturation" in found:
        limit = min(found["torque_saturation"]["limit"], limit or found["torque_saturation"]["limit"])
    joint = spec.joint(name)
    joint.armature = nominal["inertia"]
    joint.damping = [nominal["viscous_damping"], 0.0, 0.0]
    joint.frictionloss = nominal["coulomb_friction"]
    joint.actfrclimited = False  # the limit is the actuator's
    if OFFSET in found:
        more = math.degrees(found[OFFSET]["value"]) if spec.compiler.degree else found[OFFSET]["value"]
        joint.ref, joint.springref, joint.range = joint.ref + more, joint.springref + more, joint.range + more
    for actuator in list(spec.actuators):
        if actuator.target == name:
            spec.delete(actuator)
    if recording.servo:
        gain, rate = nominal["proportional_gain"], nominal["derivative_gain"]
        actuator = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.gainprm[0] = gain
        actuator.biasprm[:3] = [0.0, -gain, -rate]
        if limit is not None:
            actuator.forcelimited, actuator.forcerange = True, [-limit, limit]
        if "latency" in found:
            actuator.delay = found["latency"]["delay"]
            actuator.nsample = math.ceil(actuator.delay / min(FINE, spec.option.timestep)) + 1
    written = {*EXPRESSED, OFFSET, *(("torque_saturation", "latency") if recording.servo else ())}
    return [
        f"{each} ({', '.join(f'{key} {x:.6g}' for key, x in given.items())}): {summary(ARM_EFFECTS[each])}"
        for each, given in found.items()
        if each not in written
    ]


def hydra(named: Diagnosed, recording: ArmRecording) -> str:
    """YAML of all that was found, by joint: what `vision_s2r.fit.arm.free_run` runs."""
    lines = [f"# The arm of {recording.model.name} as it was diagnosed.", "effects:" if named else "effects: {}"]
    for name, given in named.items():
        effect = ARM_EFFECTS[name.rpartition(".")[2]]
        lines += [f"  # {summary(effect)}", f"  {name}:"]
        for parameter in effect.parameters:
            one = given[parameter.name]
            lines.append(f"    # 95 %: {one.low:.6g} to {one.high:.6g} {parameter.unit}".rstrip())
            lines.append(f"    {parameter.name}: {number(one.value)}")
    return "\n".join(lines) + "\n"
