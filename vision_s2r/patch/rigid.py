"""What the formats for rigid bodies have in common: what none of them has an attribute for, and what to do then."""

from vision_s2r.recording import JointRecording
from vision_s2r.report.reading import Diagnosed


def advice(named: Diagnosed, recording: JointRecording) -> dict[str, str]:
    """By diagnosed effect, how to bring it into a simulator whose joints do not know it; values in SI units."""
    length, torque = ("rad", "N·m") if recording.units == "rotary" else ("m", "N")
    v = {name: {key: f"{one.value:.6g}" for key, one in given.items()} for name, given in named.items()}
    found: dict[str, str] = {}

    def say(name: str, text: str) -> None:
        if name in v:
            found[name] = text.format(**v[name], length=length, torque=torque)

    say("viscous_damping", "−{value}·velocity against the motion")
    say("coulomb_friction", "dry friction of {value} {torque}")
    if "inertia" in named:
        change = named["inertia"]["value"].value - recording.nominal["inertia"]
        found["inertia"] = f"change the inertia about the joint by {change:+.6g}, to {v['inertia']['value']} in all"
    say("gravity_torque", "place the load's centre of mass so that it weighs {value} {torque} at ±90°")
    if "bias_torque" in named:
        found["bias_torque"] = f"apply a constant {-named['bias_torque']['value'].value:.6g} {torque}"
    say("torque_constant", "{value} {torque} a unit of command")
    say(
        "stribeck_friction",
        "dry friction of {static} {torque} at rest, falling to the Coulomb value as exp(−(velocity/{velocity})²)",
    )
    say("load_dependent_friction", "dry friction grows by {coefficient}·|motor torque|")
    say("backlash", "a second joint in series, free within ±{width}/2 {length}, half of the inertia on either side")
    say("torque_saturation", "clip the motor torque to ±{limit} {torque}")
    say(
        "torque_speed_limit",
        "limit the motor torque to {stall}·(1 − |velocity|/{no_load_speed}) with the motion, {stall} against it",
    )
    say("latency", "delay commands by {delay} s")
    say("encoder_quantization", "round the position that is read to {resolution} {length}")
    say("cogging", "apply {amplitude}·sin({teeth}·position)")
    say("thermal_drift", "let viscous damping grow by the factor 1 + {rate}·t")
    say("asymmetric_friction", "viscous damping ±{viscous} and dry friction ±{coulomb} by the direction of motion")
    say("load_dependent_stribeck", "dry friction grows by {coefficient}·|motor torque|·exp(−(velocity/{velocity})²)")
    say("position_offset", "the position that is read is the joint's plus {value} {length}")
    say("proportional_gain", "the servo pulls {value} units of command a {length} of error")
    say("derivative_gain", "the servo brakes {value} units of command a {length}/s")
    say("deadband", "the servo gives no torque within ±{width}/2 {length} of its target")
    say("velocity_limit", "let targets move by {value} {length}/s at most")
    say("acceleration_limit", "let the rate of targets change by {value} {length}/s² at most")
    say(
        "compliance",
        "a second joint in series, a spring of {stiffness} with damping {damping}, half of the inertia on either side",
    )
    return found


def comment(named: Diagnosed, recording: JointRecording, expressed: set[str], indent: str = "") -> list[str]:
    """XML comments: what of the diagnosis the format has no attribute for."""
    lines = [f"{name}: {text}" for name, text in advice(named, recording).items() if name not in expressed]
    # "--" may not stand in a comment of XML
    return [f"{indent}<!-- no attribute for {line.replace('--', '- -')} -->" for line in lines]
