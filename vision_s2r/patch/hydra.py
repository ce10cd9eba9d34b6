"""Configurations of this project's own simulators."""

from vision_s2r.effects import summary
from vision_s2r.joint import DYNAMICS, JOINT_EFFECTS, unit
from vision_s2r.patch.effect import CAMERA_PATCHES
from vision_s2r.recording import CameraRecording, JointRecording
from vision_s2r.report.reading import Diagnosed, ReportedParameter, library

RANDOMIZED = "each drawn from its 95 % interval"


def joint(named: Diagnosed, recording: JointRecording, randomize: bool) -> str:
    """YAML of a joint: `nominal` with the diagnosed values in it, and `effects` of the drive."""
    lines = [f"# A joint as it was diagnosed{f', {RANDOMIZED}' if randomize else ''}; SI units, {recording.units}.", ""]
    lines += ["# J·θ̈ = K·u − b·θ̇ − τ_f·sign(θ̇) − τ_g·sin θ − τ_0", "nominal:"]
    for name in [name for name in DYNAMICS if name in recording.nominal or name in named]:
        (parameter,) = JOINT_EFFECTS[name].parameters
        where = unit(parameter, recording.units)
        if name in named:
            nominal = f"{recording.nominal.get(name, 0.0):.6g}"
            lines += entry(name, named[name]["value"], where, randomize, f"; nominal was {nominal}", "  ")
        else:
            lines += [f"  # {where}; as it was", f"  {name}: {number(recording.nominal[name])}"]
    drive = {name: given for name, given in named.items() if name not in DYNAMICS}
    lines += ["# What the drive does besides, by name", "effects:" if drive else "effects: {}"]
    for name, given in drive.items():
        lines += [f"  # {summary(JOINT_EFFECTS[name])}", f"  {name}:"]
        for parameter in JOINT_EFFECTS[name].parameters:
            where = unit(parameter, recording.units)
            lines += entry(parameter.name, given[parameter.name], where, randomize, "", "    ")
    return "\n".join(lines) + "\n"


def camera(named: Diagnosed, recording: CameraRecording, randomize: bool) -> str:
    """YAML of a camera, to be put into configs/camera: the real camera that was diagnosed, or a spread around it."""
    lines = [f"# A camera as it was diagnosed{f', {RANDOMIZED}' if randomize else ''}.", *_geometry(named, recording)]
    lines += [
        "",
        "# What pixel values mean: srgb, or linear for raw sensors",
        f"encoding: {recording.encoding}",
        "# Between pixels, for warps and motion blur: bicubic or bilinear",
        "interpolation: bicubic",
        "# codec (libjpeg) or differentiable (the same in torch, with gradients)",
        "jpeg: codec",
        "# Shorter side of the pictures for which values in px are meant; at another size they scale with it",
        f"reference_size: {_size(recording)}",
        "# By effect: the probability with which it is on, and a number or [low, high] for each parameter",
        "effects:" if named else "effects: {}",
    ]
    effects = library("camera")
    for name, given in named.items():
        lines += [f"  # {summary(effects[name])}", f"  {name}:", "    # How often", "    probability: 1.0"]
        for parameter in effects[name].parameters:
            lines += entry(parameter.name, given[parameter.name], parameter.unit, randomize, "", "    ")
    return "\n".join(lines) + "\n"


def camera_overrides(named: Diagnosed, recording: CameraRecording) -> str:
    """The same camera for a command line, an override a line: they stand behind `camera=none`."""
    lines = ["camera=none", f"camera.encoding={recording.encoding}", f"camera.reference_size={_size(recording)}"]
    for name, given in named.items():
        pairs = ",".join(f"{key}:{number(one.value)}" for key, one in given.items())
        lines.append(f"+camera.effects.{name}={{probability:1.0,{pairs}}}")
    return "\n".join(lines) + "\n"


def _size(recording: CameraRecording) -> int:
    return min(recording.sim.shape[1:3])


def _geometry(named: Diagnosed, recording: CameraRecording) -> list[str]:
    """Lens and pose are in the angles of this camera: a comment for whoever uses them with another."""
    if recording.intrinsics is None or not named.keys() & set(CAMERA_PATCHES):
        return []
    fx, fy, cx, cy = recording.intrinsics
    height, width = recording.sim.shape[1:3]
    return [
        f"# Seen at fx, fy, cx, cy = {fx:.6g}, {fy:.6g}, {cx:.6g}, {cy:.6g} px in pictures of {width} x {height} px."
    ]


def entry(name: str, one: ReportedParameter, unit_name: str, randomize: bool, note: str, indent: str) -> list[str]:
    """A key with its value or interval, below a comment on it."""
    comment = f"95 %: {one.low:.6g} to {one.high:.6g}" + (f" {unit_name}" if unit_name else "") + note
    ranged = randomize and one.low < one.high
    value = f"[{number(one.low)}, {number(one.high)}]" if ranged else number(one.value)
    return [f"{indent}# {comment}", f"{indent}{name}: {value}"]


def number(value: float) -> str:
    """As YAML 1.1 takes it for a float: with a point, also before an exponent."""
    mantissa, exponent, power = f"{value:.9g}".partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + exponent + power
